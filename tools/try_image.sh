#!/bin/bash
# The commands of the Dockerfile for real, without an engine: in a Debian system made by debootstrap, which stands in
# for the base image. Then its service runs as the only process of a namespace, as the image's user, on a read-only
# root, passes the health check, renders a job and stops on SIGTERM. `make test-image` runs it, as root on Debian.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
base=${IMAGE_BASE:-out/image-base}
work=$(mktemp -d)
root=$work/root
trap 'rm -rf "$work"' EXIT

if [ "$(id -u)" != 0 ] || ! command -v debootstrap >/dev/null; then
  echo 'This needs root and the package debootstrap: apt-get install debootstrap' >&2
  exit 2
fi

# Prints the words of an instruction of a stage of the Dockerfile, 0 or 1: RUN as a line of shell, CMD as words.
instruction() {
  python3 - "$1" "$2" <<'PYTHON'
import json, re, shlex, sys
stage, wanted = int(sys.argv[1]), sys.argv[2]
text = re.sub(r"^#.*\n", "", open("Dockerfile").read(), flags=re.MULTILINE).replace("\\\n", " ")
lines = re.split(r"^FROM .*$", text, flags=re.MULTILINE)[stage + 1].splitlines()
(rest,) = (line.split(maxsplit=1)[1] for line in lines if line.split(maxsplit=1)[:1] == [wanted])
rest = rest.partition("CMD")[2] if wanted == "HEALTHCHECK" else rest
print(rest if wanted in {"RUN", "ENV", "USER"} else shlex.join(json.loads(rest)))
PYTHON
}

if [ ! -e "$base/bin/sh" ]; then
  echo "== a base image, in $base"
  debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates bookworm "$base"
fi
cp -a "$base" "$root"
ln -sf /usr/bin/python3 "$root/usr/local/bin/python"
cp /etc/resolv.conf "$root/etc/resolv.conf"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/ca-certificates.crt"

echo '== the first stage'
mkdir "$root/source"
git ls-files -z -- $(sed -n 's/^!//p' .dockerignore) | xargs -0 cp --parents -t "$root/source"
chroot "$root" sh -ec "cd /source; $(instruction 0 RUN)"
rm -rf "$root/source"

echo '== the second stage'
chroot "$root" sh -ec "$(instruction 1 RUN)"

echo '== the service'
mkdir "$work/data"
user=$(instruction 1 USER)
chown "$user" "$work/data"
cat >"$work/entry" <<ENTRY
#!/bin/bash
# Process 1 of its namespace: nothing but the data folder and /tmp can be written.
set -e
mount --bind "$root" "$root"
mount -t proc proc "$root/proc"
mount --bind /dev "$root/dev"
mount -t tmpfs tmpfs "$root/tmp"
mount --bind "$work/data" "$root/var/lib/penumbra/data"
mount -o remount,ro,bind "$root"
ip link set lo up
exec chroot --userspec=$user "$root" env -i PENUMBRA_BEHIND_PROXY=true HOME=/var/lib/penumbra $(instruction 1 ENV | sed 's/\$PATH/\/usr\/local\/bin:\/usr\/bin:\/bin/') $(instruction 1 CMD)
ENTRY
chmod +x "$work/entry"
unshare --mount --pid --fork --net --kill-child "$work/entry" 2>"$work/log" &
started=$!
inner() { pgrep --parent "$started" | head -1; }
inside() { nsenter --target "$(inner)" --mount --pid --net -- chroot --userspec="$user" "$root" env PATH=/opt/penumbra/bin:/usr/local/bin:/usr/bin:/bin HOME=/tmp "$@"; }
fail() { echo "$1" >&2; cat "$work/log" >&2; kill "$started" 2>/dev/null || true; exit 1; }

healthy=0
for _ in $(seq 300); do
  sleep 1
  kill -0 "$started" 2>/dev/null || fail 'the service has ended'
  if inside sh -c "$(instruction 1 HEALTHCHECK)" 2>/dev/null; then healthy=1; break; fi
done
[ "$healthy" = 1 ] || fail 'the health check does not pass'
echo 'the health check passes'
inside python -c "from pathlib import Path; words = Path('/proc/1/cmdline').read_bytes().split(b'\0'); assert b'serve' in words, words; print('process 1:', b' '.join(words).decode())"
if inside touch /var/lib/penumbra/file 2>/dev/null; then fail 'the root can be written'; fi
echo 'the root is read-only'
scene=/opt/penumbra/lib/python3*/site-packages/scenes/gallery/basic.json
inside sh -ec "cd /tmp; penumbra submit $scene --server http://127.0.0.1:8000 --samples 1 --light-samples 1 --wait -o /tmp/picture.png; test -s /tmp/picture.png" || fail 'the job failed'
echo 'a job is rendered'
kill -TERM "$(inner)"
status=0
wait "$started" || status=$?
[ "$status" = 0 ] || fail "it stopped with $status"
echo 'it stops on SIGTERM'

#!/bin/bash
# Build the image with podman and run it as an orchestrator would: read-only, with a health check, a job and SIGTERM.
# Without a registry, a Debian system made by debootstrap, which needs root, stands in for the base image.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
base=docker.io/library/$(sed -n 's/^FROM \(.*\) AS build$/\1/p' Dockerfile)
image=penumbra-try:$$
container=penumbra-try-$$
stand_in=
work=$(mktemp -d)
clean() {
  podman rm --force --volumes "$container" >/dev/null 2>&1 || true
  # A stand-in under the name of the base would deceive later builds.
  podman rmi --force "$image" ${stand_in:+"$base"} >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap clean EXIT

if ! command -v podman >/dev/null; then
  echo 'This needs podman: apt-get install podman' >&2
  exit 2
fi

if ! podman image exists "$base" && ! podman pull --quiet "$base"; then
  echo "== a base image in place of $base"
  debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates bookworm "$work/base"
  ln -sf /usr/bin/python3 "$work/base/usr/local/bin/python"
  cp /etc/ssl/certs/ca-certificates.crt "$work/base/etc/ssl/certs/ca-certificates.crt"
  stand_in=yes
  tar -C "$work/base" -c . | podman import - "$base"
fi

echo '== the image'
# The format of Docker keeps the health check.
podman build --pull=never --isolation chroot --layers=false --format docker --tag "$image" .

echo '== the service'
# Everyone is an admin: nothing outside of the container reaches its port. Limits that any machine allows.
podman run --detach --name "$container" --network none --read-only --ulimit nofile=1024 --ulimit nproc=1024 \
  --env PENUMBRA_BEHIND_PROXY=true --env PENUMBRA_PROXY_ROLE=admin --env PENUMBRA_HOSTS=127.0.0.1 "$image"
inside() { podman exec "$container" "$@"; }
fail() {
  echo "$1" >&2
  podman logs "$container" >&2
  exit 1
}

healthy=0
for _ in $(seq 60); do
  sleep 1
  if podman healthcheck run "$container" >/dev/null 2>&1; then healthy=1; break; fi
done
[ "$healthy" = 1 ] || fail 'the health check does not pass'
echo 'the health check passes'
inside sh -c 'tr "\0" "\n" </proc/1/cmdline' | grep -qx serve || fail 'process 1 is not the service'
echo 'process 1 is the service'
[ "$(inside id -u)" = 10001 ] || fail 'the service runs as another user'
if inside touch /var/lib/penumbra/file 2>/dev/null; then fail 'the root can be written'; fi
echo 'the root is read-only, and the user is not root'
inside sh -ec 'cd /tmp
  scene=$(python -c "import scenes; print(scenes.__path__[0])")/gallery/basic.json
  penumbra submit "$scene" --server http://127.0.0.1:8000 --samples 1 --light-samples 1 --wait -o picture.png
  test -s picture.png' || fail 'the job failed'
echo 'a job is rendered'
podman stop --time 20 "$container" >/dev/null
status=$(podman inspect --format '{{.State.ExitCode}}' "$container")
[ "$status" = 0 ] || fail "it stopped with $status"
echo 'it stops on SIGTERM'

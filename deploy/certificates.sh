#!/bin/sh
# Makes a certificate authority and one certificate for the service, the scheduler and all workers:
#   sh deploy/certificates.sh FOLDER [DAYS]
# cluster.key gives full control over the cluster. authority.key is only needed to sign the next certificate.
set -eu
folder=${1:?"Usage: certificates.sh FOLDER [DAYS]"}
days=${2:-365}
umask 077
mkdir -p "$folder"
cd "$folder"

if [ ! -f authority.key ]; then
  openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 3650 \
    -subj "/CN=Penumbra cluster authority" -keyout authority.key -out authority.pem
fi
openssl req -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes \
  -subj "/CN=Penumbra cluster" -keyout cluster.key -out cluster.csr
openssl x509 -req -in cluster.csr -CA authority.pem -CAkey authority.key -CAcreateserial \
  -days "$days" -out cluster.pem
rm cluster.csr

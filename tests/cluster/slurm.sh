#!/usr/bin/env bash
# A fleet's work on a real Slurm: four nodes on this machine (loopback only), one of them killed midway,
# submitted again. The results are to be those of `pneuma fleet run`, to the byte.
#
#     apt-get install slurm-wlm munge     # as root
#     tests/cluster/slurm.sh PNEUMA FLEET_OF_AXES
#
# with the program and the example `fleet_of_axes`, both built with --release. Prints the times of both.
set -euo pipefail
pneuma=$(realpath "$1")
fleet_of_axes=$(realpath "$2")
folder=$(mktemp -d)
export SLURM_CONF=$folder/slurm.conf
started=()
stop() {
    for file in "$folder"/*.pid; do kill "$(cat "$file")" 2>/dev/null || true; done
    for process in "${started[@]}"; do kill "$process" 2>/dev/null || true; done
}
trap stop EXIT

if [ ! -S /run/munge/munge.socket.2 ] || ! munge -n | unmunge >/dev/null 2>&1; then
    [ -f /etc/munge/munge.key ] || dd if=/dev/urandom of=/etc/munge/munge.key bs=1024 count=1 status=none
    mkdir -p /run/munge
    chown munge:munge /etc/munge/munge.key /run/munge
    chmod 400 /etc/munge/munge.key
    runuser -u munge -- munged
fi
host=$(hostname)
cat >"$SLURM_CONF" <<EOF
ClusterName=pneuma
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=17817
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CryptoType=crypto/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/%n
SlurmctldPidFile=$folder/controller.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/controller.log
SlurmdLogFile=$folder/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MpiDefault=none
NodeName=n[1-4] NodeHostname=$host NodeAddr=127.0.0.1 Port=[17821-17824] CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n[1-4] Default=YES State=UP
EOF
mkdir "$folder/state"
slurmctld -f "$SLURM_CONF"
for node in 1 2 3 4; do slurmd -f "$SLURM_CONF" -N n$node; done
until sinfo --noheader --states=idle --format=%D 2>/dev/null | grep -q 4; do sleep 1; done

"$fleet_of_axes" "$folder/fleet" 77 4 24
plan=$folder/fleet/results/plan.json
submit() {
    "$pneuma" fleet submit --plan "$plan" --to slurm --parts 8 | (cd "$folder" && sh)
    if [ $# -gt 0 ]; then "$@"; fi
    until [ -z "$(squeue --noheader)" ]; do sleep 0.5; done
}
jobs_of() { (cd "$folder/fleet/results/jobs" && sha256sum -- *.json); }

"$pneuma" fleet plan "$folder/fleet/fleet.toml"
begin=$SECONDS
"$pneuma" fleet run --plan "$plan" >/dev/null
echo "here: $((SECONDS - begin)) s"
jobs_of >"$folder/here"

rm -r "$folder/fleet/results/jobs"
begin=$SECONDS
submit
echo "Slurm, four nodes: $((SECONDS - begin)) s"
jobs_of | cmp - "$folder/here"

rm -r "$folder/fleet/results/jobs"
# A part dies while it works: its job is lost, and found missing when the work is submitted again.
kill_one() {
    until pgrep --newest --full "fleet run --plan $plan --stage night" >/dev/null; do sleep 0.2; done
    sleep 1
    pkill --signal KILL --newest --full "^$pneuma fleet run --plan $plan --stage night"
}
submit kill_one
submit
jobs_of | cmp - "$folder/here"
echo "the same results after a killed part, $(wc -l <"$folder/here") of them"

#!/bin/bash
# one_node.sh start FOLDER | stop FOLDER: a Slurm of one node on loopback, with all its files in the folder (Debian: slurm-wlm, munge; as root).
# After start: export SLURM_CONF=FOLDER/slurm.conf
set -euo pipefail

usage() {
  echo "usage: $0 start FOLDER | stop FOLDER" >&2
  exit 2
}
[[ $# -eq 2 ]] || usage
folder=$(realpath -m "$2")
export SLURM_CONF=$folder/slurm.conf

start() {
  local command
  for command in munged slurmctld slurmd; do
    [[ -x $(command -v $command || echo /usr/sbin/$command) ]] || { echo "there is no $command: apt-get install slurm-wlm munge" >&2; exit 2; }
  done
  [[ $(id -u) -eq 0 ]] || { echo "slurmd must be started as root" >&2; exit 2; }
  mkdir -p "$folder"/{munge,state,spool}
  chown root "$folder" "$folder"/munge
  chmod 755 "$folder" "$folder"/munge
  (umask 077; dd if=/dev/urandom of="$folder"/munge/key bs=128 count=1 status=none)
  local name cores
  name=$(hostname -s)
  cores=$(nproc)
  cat > "$SLURM_CONF" <<CONF
ClusterName=one
SlurmctldHost=$name(127.0.0.1)
SlurmUser=root
SlurmctldPort=16817
SlurmdPort=16818
AuthInfo=socket=$folder/munge/socket
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/slurmd.log
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
KillWait=5
JobRequeue=1
SchedulerParameters=batch_sched_delay=1,sched_interval=2
NodeName=$name NodeAddr=127.0.0.1 CPUs=$cores RealMemory=2000 State=UNKNOWN
PartitionName=all Nodes=$name Default=YES MaxTime=INFINITE State=UP
CONF
  /usr/sbin/munged --force --key-file="$folder"/munge/key --socket="$folder"/munge/socket --pid-file="$folder"/munged.pid \
    --log-file="$folder"/munge/log --seed-file="$folder"/munge/seed
  /usr/sbin/slurmctld -c
  /usr/sbin/slurmd -c
  for _ in {1..60}; do
    [[ $(sinfo --noheader --format=%T 2>/dev/null) == idle ]] && return 0
    sleep 0.5
  done
  echo "the node did not come up; see $folder/slurmctld.log and $folder/slurmd.log" >&2
  exit 1
}

stop() {
  local file id
  # Jobs end while the daemons live that they report to.
  scancel --user="$(id -un)" 2>/dev/null || true
  for _ in {1..60}; do
    [[ -n $(squeue --noheader 2>/dev/null) ]] || break
    sleep 0.5
  done
  for file in "$folder"/{slurmd,slurmctld,munged}.pid; do
    [[ -s $file ]] || continue
    id=$(cat "$file")
    kill "$id" 2>/dev/null || continue
    for _ in {1..40}; do
      kill -0 "$id" 2>/dev/null || continue 2
      sleep 0.25
    done
    kill -9 "$id" 2>/dev/null || true
  done
}

case $1 in
  start) start ;;
  stop) stop ;;
  *) usage ;;
esac

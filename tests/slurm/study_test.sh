#!/bin/bash
# study_test.sh HEDDLE: `heddle study --engine slurm` on a real Slurm of one node: a job is killed, the node is drained in the middle, and all
# runs finish, those that were stopped from their checkpoints. Takes about a minute; not part of the tests that CTest runs.
set -euo pipefail
heddle=$(realpath "$1")
here=$(realpath "$(dirname "$0")")
folder=$(mktemp -d)
export SLURM_CONF=$folder/slurm/slurm.conf
study=
trap '[[ -z $study ]] || kill $study 2>/dev/null || true; "$here"/one_node.sh stop "$folder"/slurm' EXIT
fail() {
  echo "FAILED: $*; files in $folder" >&2
  cat "$folder"/study.log >&2
  exit 1
}
# wait_for SECONDS COMMAND...: until it succeeds
wait_for() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    [[ $SECONDS -lt $end ]] || return 1
    sleep 0.2
  done
}

# Stands for `heddle run`: eight steps of a second, each kept as a checkpoint.
cat > "$folder"/program <<'PROGRAM'
#!/bin/bash
while [[ $# -gt 0 ]]; do
  [[ $1 == --output ]] && out=$2
  shift
done
trap 'exit 130' TERM
mkdir -p "$out/weave"
step=$(cat "$out/checkpoint" 2>/dev/null || echo 0)
echo "from step $step"
while [[ $step -lt 8 ]]; do
  sleep 1 & wait $!
  step=$((step + 1))
  echo $step > "$out/checkpoint"
done
echo "{\"reed_load_max_N\": $step}" > "$out/weave/summary.json"
PROGRAM
chmod +x "$folder"/program
cat > "$folder"/study.toml <<STUDY
name = "slurm"
question = "Do runs survive the cluster?"
case = "$here/../../cases/kevlar_km2_706"
collect = ["weave.reed_load_max_N"]
[vary]
loom.tension = [1, 2, 3, 4, 5]
STUDY

"$here"/one_node.sh start "$folder"/slurm
node=$(hostname -s)
"$heddle" study "$folder"/study.toml --engine slurm --jobs 2 --output "$folder"/out --program "$folder"/program --poll 1 > "$folder"/study.log 2>&1 &
study=$!
step_of() { cat "$folder/out/runs/$1/checkpoint" 2>/dev/null || echo 0; }
at_step() { [[ $(step_of "$1") -ge $2 ]]; }

wait_for 60 at_step tension_1 2 || fail "the first run does not start"
job=$(squeue --noheader --array --format='%i %K' | awk '$2 == 0 {print $1}')
scancel "$job"
echo "killed job $job"

wait_for 60 at_step tension_3 2 || fail "the third run does not start"
scontrol update nodename="$node" state=drain reason=test
echo "drained $node"
finished() { grep -q '"state": "finished"' "$folder/out/runs/$1/run.json" 2>/dev/null; }
wait_for 60 finished tension_3 || fail "a run on a drained node does not end"
sleep 3
kill -0 $study || fail "the study gave up while the node was drained"
scontrol update nodename="$node" state=resume || fail "the node does not resume"

# The node is lost with what runs on it, and comes back.
wait_for 60 at_step tension_5 2 || fail "the fifth run does not start"
scontrol update nodename="$node" state=down reason=test
echo "$node is down"
up() { [[ $(sinfo --noheader --format=%T) =~ ^(idle|mixed|allocated)$ ]] || ! scontrol update nodename="$node" state=resume; }
wait_for 30 up || fail "the node does not come back"

wait $study || fail "the study ended with $?"
for run in tension_{1..5}; do
  finished $run || fail "$run did not finish"
done
grep -q "from step [1-9]" "$folder"/out/runs/tension_1/run.log || fail "the killed job did not go on from its checkpoint"
grep -q "from step [1-9]" "$folder"/out/runs/tension_5/run.log || fail "the job on the lost node did not go on from its checkpoint"
[[ $(grep -c "from step 0" "$folder"/out/runs/*/run.log | awk -F: '{n += $2} END {print n}') -eq 5 ]] || fail "a run began twice"
cat "$folder"/study.log
"$here"/one_node.sh stop "$folder"/slurm
trap - EXIT
rm -rf "$folder"
echo "passed"

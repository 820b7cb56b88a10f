#!/usr/bin/env bash
# shellcheck source=lib.sh
# Many fabrics: lists, tasks of job arrays, and a Slurm of two nodes on this machine.
. "$(dirname "$0")/lib.sh"

# A list of small fabrics, one of them in three parts.
list() {
  cat >list.json <<'EOF'
{"defaults": {"quality": "draft", "texels": 4, "views": 16, "lights": 16, "samples": 2, "set": {"yarn": "tube"}},
 "fabrics": [
  {"stitch": "plain-knit", "output": "out/knit-{variant}.fabric.exr",
   "variants": {"red": {"set": {"albedo": "#a02030"}}, "blue": {"set": {"albedo": [0.1, 0.2, 0.5]}}}},
  {"stitch": "twill", "output": "out/twill.fabric.exr", "shards": 3},
  {"stitch": "own stitch.json", "output": "out/own.fabric.exr", "set": null, "sides": "both"}]}
EOF
  selvedge stitch plain-weave --set yarn=tube -o "own stitch.json"
}

test_a_list_makes_what_is_not_up_to_date() {
  list
  selvedge make --list list.json --dry-run --json >dry.json
  holds 'r.made === 4 && r.fabrics.every((f) => f.state === "toMake")' dry.json
  [ ! -e out ]
  selvedge make --list list.json --page page --quiet
  # What the command of the row makes, but for the record of what it is made of, and other colours.
  node -e 'for (const f of JSON.parse(require("fs").readFileSync("dry.json")).fabrics) console.log(f.command)' |
    sed 's/=out/=single/' >commands
  mkdir single
  . ./commands
  for made in out/*.exr; do
    selvedge repack "$made" -o a.exr --quiet
    selvedge repack "single/${made##*/}" -o b.exr --quiet
    same a.exr b.exr
  done
  cmp -s out/knit-red.fabric.exr out/knit-blue.fabric.exr && fail "the variants are the same"
  selvedge check out/*.exr
  [ "$(find page/pictures -name '*.png' | wc -l)" = 4 ]
  # By contents: neither times nor what another file says count.
  touch "own stitch.json"
  before=$(snapshot)
  selvedge make --list list.json --json >again.json
  holds 'r.upToDate === 4 && r.made === 0 && r.fabrics[0].psnr > 5' again.json
  rm again.json
  [ "$before" = "$(snapshot)" ]
  echo >>"own stitch.json"
  rm out/knit-red.fabric.exr
  sed -i 's/"sides": "both"/"sides": "front"/' list.json
  selvedge make --list list.json --json >again.json
  holds 'r.upToDate === 2 && r.fabrics[1].state === "made" && r.fabrics[3].state === "made"' again.json
  # A fabric that was repacked is another.
  selvedge repack out/twill.fabric.exr --levels 1 -o out/twill.fabric.exr --quiet
  selvedge make --list list.json --json >again.json
  holds 'r.made === 1 && r.fabrics[2].state === "made"' again.json
}

test_a_list_goes_on_after_a_fabric_that_fails() {
  list
  sed -i 's/"twill"/"no-stitch"/' list.json
  exits 1 selvedge make --list list.json --json
  holds 'r.failed === 1 && r.fabrics.length === 3 && r.fabrics[2].error.code === "STITCH_UNKNOWN"'
  exits 1 selvedge make --list list.json --keep-going --json
  holds 'r.failed === 1 && r.upToDate === 2 && r.made === 1 && r.fabrics.length === 4'
}

test_a_list_is_read_whole_before_any_work() {
  list
  bad() {
    sed "$3" list.json >bad.json
    refuses "$1" "bad.json: $2" selvedge make --list bad.json
  }
  bad OPTION_OUT_OF_RANGE "/fabrics/1: unknown option --vews" 's/"twill"/"twill", "vews": 3/'
  bad OPTION_OUT_OF_RANGE "/fabrics/2" 's/"sides": "both"/"sides": "inside"/'
  bad JSON_MALFORMED "/fabrics/2: has the output of /fabrics/1" 's/own.fabric/twill.fabric/'
  bad JSON_MALFORMED "/fabrics/0/variants/red: has the output of /fabrics/0/variants/blue" 's/-{variant}//'
  bad JSON_MALFORMED "/fabrics/1/shards" 's/"shards": 3/"shards": 0/'
  bad JSON_MALFORMED "/fabrics/1/seed" 's/"twill"/"twill", "seed": ""/'
  bad JSON_MALFORMED "/fabrics/1/views: is no option" 's/"twill"/"twill", "views": true/'
  bad JSON_MALFORMED "/fabrics/1/threads: has no place" 's/"twill"/"twill", "threads": 2/'
  bad JSON_MALFORMED "/more" 's/{"defaults"/{"more": 1, "defaults"/'
  bad JSON_MALFORMED "" 's/^{/[/'
  # No other option comes through as the name or the value of one, and nothing that ends a path or a line.
  bad JSON_MALFORMED "/fabrics/1/keep-samples=smuggled: is no option" 's/"twill"/"twill", "keep-samples=smuggled": "x"/'
  bad JSON_MALFORMED "/fabrics/1/stitch" 's/"twill"/"--keep-samples=smuggled"/'
  bad JSON_MALFORMED "/fabrics/1/output: has a control character" 's/twill.fabric/twill\\u0000.fabric/'
  bad JSON_MALFORMED "/fabrics/1/output: has a control character" 's/twill.fabric/twill\\u001b[31m.fabric/'
  bad JSON_MALFORMED "/fabrics/1: has a control character" 's/"twill"/"twill", "view\\ns": 3/'
  # What one reads no other writes.
  bad JSON_MALFORMED "/fabrics/1: writes over own stitch.json" 's/out.twill.fabric.exr/own stitch.json/'
  bad JSON_MALFORMED "/fabrics/1: writes over bad.json" 's/out.twill.fabric.exr/bad.json/'
  exits 2 selvedge make --list list.json --views 3
  exits 2 selvedge make --list list.json --task 2/2
  exits 2 selvedge make plain-knit -o k.exr --task 0/2
  exits 2 selvedge make plain-knit
}

test_parts_make_the_bytes_of_a_whole_bake() {
  list
  selvedge make --list list.json --quiet
  cp out/twill.fabric.exr whole.exr
  rm out/twill.fabric.exr
  refuses FILE_MISSING "lacks parts 0/3, 1/3, 2/3 of its bake: selvedge make twill " \
    selvedge make --list list.json --task 2/4 --quiet
  selvedge make --list list.json --parts --task 0/2 --quiet
  refuses FILE_MISSING "lacks part 1/3 of its bake: selvedge make twill " selvedge make --list list.json --task 2/4 --quiet
  selvedge make --list list.json --parts --json >parts.json
  holds 'r.fabrics.length === 3 && r.made === 3' parts.json
  # Parts of other options are none of this fabric's.
  sed 's/"shards": 3/"shards": 3, "seed": 7/' list.json >other.json
  refuses FILE_MISSING "lacks parts 0/3, 1/3, 2/3" selvedge make --list other.json --task 2/4 --quiet
  # A part that is cut short is missing.
  cp out/*.part-1-of-3 part
  head -c 20000 part >"$(ls out/*.part-1-of-3)"
  refuses FILE_MISSING "lacks part 1/3" selvedge make --list list.json --task 2/4 --quiet
  cp part "$(ls out/*.part-1-of-3)"
  selvedge make --list list.json --task 2/4 --quiet
  same out/twill.fabric.exr whole.exr
  [ "$(find out -name '*.part-*')" = "" ]
}

test_make_writes_a_depfile() {
  list
  selvedge make "own stitch.json" "${small[@]}" --depfile d -o k.fabric.exr --quiet
  [ "$(cat d)" = 'k.fabric.exr: own\ stitch.json' ]
  printf 'k.fabric.exr:\n\techo made\ninclude d\n' >Makefile
  if command -v make >/dev/null; then
    [ "$(make -s k.fabric.exr)" = "make: 'k.fabric.exr' is up to date." ] || [ "$(make -s k.fabric.exr)" = "" ]
    touch "own stitch.json"
    [ "$(make -s k.fabric.exr)" = made ]
  fi
}

# Slurm's daemons in the scratch folder, on ports of their own: nodes n0 and n1 of two cores each.
start_slurm() {
  for program in slurmctld slurmd sbatch; do
    command -v $program >/dev/null || { echo "Slurm is not here: skipped" >&2; exit 77; }
  done
  [ "$(id -u)" = 0 ] || { echo "slurmd needs root: skipped" >&2; exit 77; }
  local port=$((20000 + $$ % 20000))
  export SLURM_CONF=$scratch/slurm.conf
  mkdir "$scratch/state"
  cat >"$SLURM_CONF" <<EOF
ClusterName=selvedge
SlurmctldHost=localhost
SlurmUser=root
AuthType=auth/none
CredType=cred/none
SlurmctldPort=$port
StateSaveLocation=$scratch/state
SlurmdSpoolDir=$scratch/spool-%n
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdPidFile=$scratch/slurmd-%n.pid
SlurmctldLogFile=$scratch/slurmctld.log
SlurmdLogFile=$scratch/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName=n[0-1] NodeHostname=localhost NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + 2))] CPUs=2
PartitionName=all Nodes=ALL Default=YES State=UP
EOF
  trap 'pkill -F "$scratch/slurmd-n0.pid"; pkill -F "$scratch/slurmd-n1.pid"; pkill -F "$scratch/slurmctld.pid"
    sleep 1; rm -rf "$scratch"' EXIT
  slurmctld && slurmd -N n0 && slurmd -N n1
  for _ in $(seq 50); do
    if [ "$(sinfo -h -o %T 2>/dev/null)" = idle ]; then return; fi
    sleep 0.2
  done
  echo "Slurm does not start here: skipped" >&2
  exit 77
}

# Whether the queue is empty within some minutes.
queue_ends() {
  for _ in $(seq 400); do
    if [ -z "$(squeue -h)" ]; then return; fi
    # What was queued again would wait for two minutes.
    squeue -h -r -t PENDING -o %i | xargs -r -I{} scontrol update jobid={} starttime=now 2>/dev/null || true
    sleep 0.5
  done
  fail "the queue does not end: $(squeue)"
}

test_slurm_makes_the_bytes_of_one_machine() {
  start_slurm
  list
  # Long enough to be killed in the middle.
  sed -i 's/"shards": 3/"shards": 3, "texels": 16, "views": 64, "samples": 64/' list.json
  sed 's/out\//alone\//' list.json >alone.json
  selvedge make --list alone.json --quiet
  read -r parts fabrics <<<"$("$root/docs/cluster/slurm" list.json 4 --output="$scratch/%x-%a.log")"
  for _ in $(seq 100); do
    if compgen -G "out/*.part-*.journal" >/dev/null; then break; fi
    sleep 0.05
  done
  # One task is killed in the middle and queued again, then a node goes down with what it runs.
  scontrol requeue "${parts}_0" 2>"$scratch/requeue" || true
  scontrol update nodename=n1 state=down reason=test
  sleep 2
  scontrol update nodename=n1 state=resume 2>"$scratch/resume" || scontrol update nodename=n1 state=idle
  queue_ends
  diff -r alone out || fail "$(cat "$scratch"/selvedge-*.log)"
  # A second submission makes nothing.
  before=$(snapshot)
  read -r parts fabrics <<<"$("$root/docs/cluster/slurm" list.json 4 --output="$scratch/again-%x-%a.log")"
  queue_ends
  [ "$before" = "$(snapshot)" ]
  grep -q "up to date" "$scratch"/again-selvedge-fabrics-0.log
}

"$2"

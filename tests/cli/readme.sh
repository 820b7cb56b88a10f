#!/usr/bin/env bash
# Runs what the README tells people to run: readme.sh BIN README. Every line of its fenced sh and console blocks, in
# order, from a folder that looks like the project's root, so that out/ is not the source tree's. The scripts that
# build and test everything (and would run this again) and CMake's own commands are only looked up.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"
readme=$2
[ -r "$readme" ] || fail "no README: $readme"

# The root as people have it, with the programs where the README says they are.
for entry in "$root"/*; do
  case ${entry##*/} in build | out) ;; *) ln -s "$entry" . ;; esac
done
mkdir -p build/release out
ln -s "$bin" build/release/bin

# Commands, one a line: continued lines are joined; a console block's commands are those after "$ ".
commands() {
  awk '/^ *```/ { kind = kind != "" ? "" : ($0 ~ /```sh *$/ ? "sh" : $0 ~ /```console *$/ ? "console" : "other"); next }
    kind == "console" && !more { if (!sub(/^ *\$ /, "")) next }
    kind == "sh" || kind == "console" {
      sub(/^ +/, more ? " " : "")
      more = sub(/\\$/, "")
      printf "%s%s", $0, more ? "" : "\n"
    }' "$1" | grep -vE '^(#|$)'
}

# has_preset NAME: CMakePresets.json has it.
has_preset() { grep -q "\"name\": \"$1\"" "$root/CMakePresets.json" || fail "no preset $1"; }

count=0
ran=0
while IFS= read -r line; do
  read -ra words <<<"$line"
  case ${words[0]} in
    # The demo's folder stays, its files do not: nothing below may need them.
    ./demo)
      [ -x "$root/demo" ] || fail "is no script: $line"
      mkdir -p out
      ;;
    # A window waits for somebody to close it: tests/cli/show.sh.
    build/release/bin/selvedge-view)
      if [ "${words[1]}" = show ]; then line='build/release/bin/selvedge-view show --help >/dev/null'; fi
      ;;&
    build/release/bin/* | node)
      echo "$line"
      bash -c "set -e; $line" </dev/null
      ran=$((ran + 1))
      ;;
    mkdir) bash -c "set -e; $line" ;;
    ./* | .ci/* | tests/*) [ -f "$root/${words[0]}" ] && [ -x "$root/${words[0]}" ] || fail "is no script: $line" ;;
    cmake | ctest)
      for ((i = 1; i < ${#words[@]}; ++i)); do
        if [ "${words[i]}" = --preset ]; then has_preset "${words[i + 1]}"; fi
      done
      ;;
    git | cd) [ "$ran" = 0 ] || fail "only at the beginning: $line" ;;
    *) fail "unknown command: $line" ;;
  esac
  count=$((count + 1))
done < <(commands "$readme")
[ "$ran" -gt 0 ] || fail "$readme has nothing to run"
echo "$count commands of ${readme##*/} are good, $ran of them ran"

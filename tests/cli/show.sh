#!/usr/bin/env bash
# The window of `selvedge-view show` under a virtual X server, handled with real events of mouse and keyboard.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

for tool in Xvfb xdotool; do
  if ! command -v "$tool" >/dev/null; then
    echo "skipped: there is no $tool" >&2
    exit 77
  fi
done

# with_window ARGUMENTS... -- XDOTOOL COMMANDS: shows with these arguments, does what is said once the window is there,
# presses Escape. Reports as JSON in report.json, gives show's exit status.
with_window() {
  local arguments=() viewer status=0 number
  while [ "$1" != -- ]; do
    arguments+=("$1")
    shift
  done
  shift
  mkfifo number.fifo
  Xvfb -displayfd 3 -screen 0 1000x700x24 3>number.fifo >server.log 2>&1 &
  server=$!
  trap 'kill "$server" 2>/dev/null || true; rm -rf "$scratch"' EXIT
  read -r number <number.fifo
  rm number.fifo
  export DISPLAY=:$number
  # The address sanitizer looks for leaks when the driver of OpenGL, whose leaks they are, is unloaded and has no name.
  ASAN_OPTIONS=${ASAN_OPTIONS-}:detect_leaks=0 timeout 60 selvedge-view show "${arguments[@]}" --size 900x600 --json >report.json 2>errors.txt &
  viewer=$!
  timeout 20 xdotool search --sync --onlyvisible --name Selvedge >/dev/null || fail "no window: $(cat errors.txt)"
  sleep 1
  while [ $# -gt 0 ]; do
    # shellcheck disable=SC2086
    xdotool $1
    sleep 0.2
    shift
  done
  xdotool key Escape
  wait "$viewer" || status=$?
  kill "$server"
  wait "$server" || true
  unset DISPLAY
  return "$status"
}

test_show_turns_moves_and_nears_with_the_mouse() {
  make_scene
  with_window quad.glb --screenshot before.png -- 'mousemove 300 300'
  holds 'r.camera.azimuth === 0 && r.camera.elevation === 0' report.json
  mv report.json still.json
  # 100 pixels to the right and 50 up, of the window's 600.
  with_window quad.glb --screenshot after.png -- 'mousemove 300 300' 'mousedown 1' 'mousemove 350 275' \
    'mousemove 400 250' 'mouseup 1' 'mousemove 300 300'
  holds 'Math.abs(r.camera.azimuth + 30) < 1e-6 && Math.abs(r.camera.elevation + 15) < 1e-6' report.json
  exits 1 compare-pictures before.png after.png --max 0.2
  with_window quad.glb -- 'mousemove 300 300' 'mousedown 2' 'mousemove 360 300' 'mouseup 2' 'click 4' 'click 5'
  holds '(() => {
    const first = JSON.parse(require("fs").readFileSync("still.json", "utf8")).camera;
    const metres = 2 * Math.tan(first.fov * Math.PI / 360) * first.distance * 60 / 600;
    return Math.abs(r.camera.lookAt[0] - first.lookAt[0] + metres) < 1e-6
      && Math.abs(r.camera.distance - first.distance) < 1e-9;
  })()' report.json
}

test_show_hides_the_panel_and_takes_the_fabrics_away_by_keys() {
  make_scene
  with_window quad.glb -- 'mousemove 200 300' 'key h' 'key c'
  holds 'r.window.join() === "900,600" && r.width === 900 && r.fabrics[0] === -1' report.json
  with_window quad.glb -- 'mousemove 200 300' 'key c' 'key c'
  holds 'r.width < 600 && r.fabrics[0] === 0' report.json
}

test_show_plays_a_clip_pauses_it_and_steps() {
  make_scene
  write_slide 0.2
  selvedge dress slide.gltf k.fabric.exr -o slide.glb --all --quiet
  with_window slide.glb -- 'sleep 1'
  holds 'r.clip.plays && r.clip.time > 0 && r.clip.time < 0.2' report.json
  [ ! -s errors.txt ] || fail "says: $(cat errors.txt)"
  with_window slide.glb -- 'key --repeat 12 --repeat-delay 200 Left' 'key Right' 'key Right' 'sleep 2' 'key s'
  holds '!r.clip.plays && Math.abs(r.clip.time - 2 / 30) < 1e-9 && r.message === "saved slide-1.png"' report.json
  node -p 'JSON.parse(fs.readFileSync("report.json")).command' >command
  bash command
  compare-pictures slide-1.png picture.png --json >compared.json
  holds 'r.psnr > 45' compared.json
  with_window slide.glb -- 'key space' 'key space' 'key space'
  holds '!r.clip.plays' report.json
  # The second one of the list, four times as fast, halfway.
  edited slide.gltf two.gltf 'g.animations.push({ ...g.animations[0], name: "again" })'
  selvedge dress two.gltf k.fabric.exr -o two.glb --all --quiet
  with_window two.glb -- 'mousemove 767 151' 'click 1' 'sleep 1' 'mousemove 700 196' 'click 1' 'sleep 1' \
    'mousemove 868 217' 'mousedown 1' 'sleep 0.3' 'mouseup 1' 'mousemove 767 195' 'mousedown 1' 'sleep 0.3' 'mouseup 1'
  holds '!r.clip.plays && Math.abs(r.clip.time - 0.1) < 0.002 && r.clip.speed === 4 && r.command.includes(" --animation=1 ")' report.json
}

test_show_swaps_fabrics() {
  make_scene
  make_plane_fabric
  with_window quad.glb --fabric plane.fabric.exr -- 'mousemove 200 300' 'key f'
  holds 'r.fabrics[0] === 1 && r.probe.fabric === "plane.fabric.exr"' report.json
}

test_show_dresses_a_garment_compares_and_saves_it() {
  make_plane_fabric
  mkdir fabrics
  cp plane.fabric.exr fabrics/other.exr
  echo none >fabrics/broken.exr
  with_window quad.gltf --fabric plane.fabric.exr --fabric fabrics --azimuth 30 -- 'sleep 2' 'key d' 'key d'
  [ ! -s errors.txt ] || fail "says: $(cat errors.txt)"
  holds 'r.input === "quad.gltf" && r.fabrics[0] === 0 && r.camera.azimuth === 30' report.json
  cmp quad-1.glb quad-2.glb
  selvedge check quad-1.glb
  # As by the command line.
  selvedge dress quad.gltf plane.fabric.exr --all -o told.glb --quiet
  selvedge info told.glb --json >told.json
  selvedge info quad-1.glb --json >saved.json
  node -e 'const read = name => JSON.parse(require("fs").readFileSync(name, "utf8")).content.materials;
    require("assert").deepStrictEqual(read("saved.json"), read("told.json"));'
  with_window quad-1.glb --fabric fabrics --screenshot one.png -- 'sleep 2' 'mousemove 200 300' 'key b' 'key c'
  holds 'r.fabrics[0] === -1' report.json
  # Left of the bar it is as it was, right of it without the fabric; a drag moves the bar.
  with_window quad-1.glb --screenshot other.png -- 'sleep 2' 'mousemove 200 300' 'key b' 'key c' 'mousemove 285 200' \
    'mousedown 1' 'mousemove 200 200' 'mousemove 100 200' 'mouseup 1'
  holds 'r.camera.azimuth === 0' report.json
  exits 1 compare-pictures one.png other.png --max 0.2
}

test_show_saves_the_picture_and_tells_the_command_that_draws_it() {
  make_scene
  with_window quad.glb -- 'mousemove 200 300' 'mousedown 1' 'mousemove 300 260' 'mouseup 1' 'sleep 2' 'key s'
  [ -s quad-1.png ] || fail "no picture: $(cat report.json)"
  holds 'r.message === "saved quad-1.png"' report.json
  node -e 'console.log(JSON.parse(require("fs").readFileSync("report.json", "utf8")).command)' >command
  # Rounding moves single samples over an edge of the cloth.
  bash command
  compare-pictures quad-1.png picture.png --json >compared.json
  holds 'r.psnr > 45' compared.json
}

"$2"

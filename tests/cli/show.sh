#!/usr/bin/env bash
# The window of `selvedge-view show` under a virtual X server, handled with real events of mouse and keyboard.
# shellcheck source=tests/cli/lib.sh
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

need_screen() {
  for tool in Xvfb xdotool; do
    if ! command -v "$tool" >/dev/null; then
      echo "skipped: there is no $tool" >&2
      exit 77
    fi
  done
}

# A textured square of 0.1 m that fills the window, one level without blending: every pixel sees one texel.
make_cloth() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --quiet "${small[@]}" >/dev/null
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
}

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

test_show_without_a_display_is_one_line() {
  make_plane_fabric
  unset DISPLAY WAYLAND_DISPLAY
  refuses GRAPHICS_UNAVAILABLE window selvedge-view show plane.fabric.exr
}

test_show_refuses_what_it_cannot_read_before_a_window_opens() {
  make_plane_fabric
  cut_short plane.fabric.exr short.fabric.exr
  unset DISPLAY WAYLAND_DISPLAY
  refuses FILE_DAMAGED short.fabric.exr selvedge-view show short.fabric.exr
  refuses FILE_MISSING nothing.glb selvedge-view show nothing.glb
  exits 2 selvedge-view show
  exits 2 selvedge-view show plane.fabric.exr --size 0x4
  exits 2 selvedge-view show plane.fabric.exr --screenshot window.jpg
}

test_show_probes_the_texel_under_the_mouse_and_its_light() {
  need_screen
  make_cloth
  with_window quad.glb --level 0 --environment none --shadows 0 -- 'mousemove 200 250' 'mousemove 233 287'
  [ ! -s errors.txt ] || fail "says: $(cat errors.txt)"
  # Where the ray through the pixel's centre meets the plane z = 0; dressing repeats the fabric by its size.
  selvedge info k.fabric.exr --json >info.json
  holds '(() => {
    const fs = require("fs"), info = JSON.parse(fs.readFileSync("info.json", "utf8"));
    const [x, y] = r.probe.pixel, c = r.camera, slope = Math.tan(c.fov * Math.PI / 360);
    if (x !== 233 || y !== 287 || c.azimuth !== 0 || c.elevation !== 0) return false;
    const metres = 2 * slope * c.distance / r.height;
    const at = [c.lookAt[0] + (x + 0.5 - r.width / 2) * metres, c.lookAt[1] + (r.height / 2 - y - 0.5) * metres];
    const [width, height] = info.content.texels, period = info.content.mmPerRepeat;
    const uv = [at[0] * 1000 / period[0], (0.1 - at[1]) * 1000 / period[1]].map(v => v - Math.floor(v));
    const texel = [Math.floor(uv[0] * width), Math.floor(uv[1] * height)];
    const t = r.probe.texels;
    return Math.abs(uv[0] - r.probe.uv[0]) < 1e-4 && Math.abs(uv[1] - r.probe.uv[1]) < 1e-4 && t.length === 1
      && t[0].level === 0 && t[0].texel.join() === texel.join();
  })()' report.json
  # The same texel as the reference evaluates it, light for light.
  node -e 'const r = JSON.parse(require("fs").readFileSync("report.json", "utf8"));
    for (const light of r.probe.lights)
      console.log(`--level 0 --texel ${r.probe.texels[0].texel} --light ${light} --view ${r.probe.view}`);' >evaluations.txt
  local i=0 arguments
  while read -r arguments; do
    # shellcheck disable=SC2086
    selvedge evaluate k.fabric.exr $arguments --json >"light$i.json"
    i=$((i + 1))
  done <evaluations.txt
  [ "$i" = 2 ] || fail "not two lights but $i"
  holds '(() => {
    const fs = require("fs");
    const lights = [0, 1].map(i => JSON.parse(fs.readFileSync(`light${i}.json`, "utf8")));
    return r.probe.radiance.every((value, c) => {
      const sum = lights.reduce((s, l, i) => s + l.rgb[c] * r.lights[i].irradiance[c], 0);
      return Math.abs(value - sum) <= 0.05 * Math.max(sum, 1e-2);  // one view stands for a repeat
    }) && lights[0].alpha > 0 && Math.abs(r.probe.alpha - lights[0].alpha) < 2e-2;
  })()' report.json
}

test_show_turns_moves_and_nears_with_the_mouse() {
  need_screen
  make_cloth
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

test_show_turns_the_light_with_the_right_button() {
  need_screen
  make_cloth
  with_window quad.glb --light 0,0,1 --light-frame camera -- 'mousemove 200 300' 'mousedown 3' 'mousemove 300 300' 'mouseup 3'
  # A sixth of half a turn to the right.
  holds 'r.camera.azimuth === 0 && Math.abs(r.lights[0].direction[0] - 0.5) < 1e-6
    && Math.abs(r.lights[0].direction[2] - Math.sqrt(0.75)) < 1e-6' report.json
}

test_show_uses_the_lights_of_the_file_unless_others_are_asked_for() {
  need_screen
  write_quad quad.gltf
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync("quad.gltf", "utf8"));
    g.extensionsUsed = ["KHR_lights_punctual"];
    g.extensions = {KHR_lights_punctual: {lights: [{type: "point", intensity: 4}, {type: "directional", intensity: 2}]}};
    g.nodes.push({translation: [1, 2, 3], extensions: {KHR_lights_punctual: {light: 0}}},
      {extensions: {KHR_lights_punctual: {light: 1}}});
    g.scenes[0].nodes.push(1, 2);
    fs.writeFileSync("lit.gltf", JSON.stringify(g));'
  # A drag turns the one that is far away; the other one stays where it is.
  with_window lit.gltf -- 'mousemove 200 300' 'mousedown 3' 'mousemove 300 300' 'mouseup 3'
  # The studio beside them adds two.
  holds 'r.lights.length === 4 && r.lights[0].position.join() === "1,2,3" && !r.lights[0].direction
    && r.lights[0].irradiance[0] === 4 && r.lights[1].irradiance[0] === 2
    && Math.abs(r.lights[1].direction[0] - 0.5) < 1e-6' report.json
  with_window lit.gltf --point-light 0,0,2,9 -- 'mousemove 200 300'
  holds 'r.lights.length === 1 && r.lights[0].position.join() === "0,0,2" && r.lights[0].irradiance[0] === 9' report.json
}

test_show_hides_the_panel_and_takes_the_fabrics_away_by_keys() {
  need_screen
  make_cloth
  with_window quad.glb -- 'mousemove 200 300' 'key h' 'key c'
  holds 'r.window.join() === "900,600" && r.width === 900 && r.fabrics[0] === -1' report.json
  with_window quad.glb -- 'mousemove 200 300' 'key c' 'key c'
  holds 'r.width < 600 && r.fabrics[0] === 0' report.json
}

test_show_swaps_fabrics() {
  need_screen
  make_cloth
  make_plane_fabric
  with_window quad.glb --fabric plane.fabric.exr -- 'mousemove 200 300' 'key f'
  holds 'r.fabrics[0] === 1 && r.probe.fabric === "plane.fabric.exr"' report.json
}

test_show_dresses_a_garment_compares_and_saves_it() {
  need_screen
  make_plane_fabric
  write_quad quad.gltf
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
  need_screen
  make_cloth
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

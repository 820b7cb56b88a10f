#!/usr/bin/env bash
# What holds for every verb: help, reports, exit statuses, progress; and the verbs that only read.
source "$(dirname "${BASH_SOURCE[0]}")/lib.sh"

verbs=(stitch bake import fit make plan dress export check info evaluate compare truth)

# The examples that the help of a verb gives, one per line.
examples() { "$@" --help | sed -n '/^Examples\{0,1\}:/,/^$/s/^  \(selvedge.*\)/\1/p'; }

# The files that the examples speak of.
make_example_files() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --keep-samples k.samples.exr \
    --quiet "${small[@]}"
  write_quad quad.gltf
  sed 's/"cloth"/"Cotton"/' quad.gltf >shirt.gltf
  selvedge dress shirt.gltf k.fabric.exr -o dressed.glb --all --quiet
  cp dressed.glb shirt.glb
  make_knitted knitted.glb
  write_pictures pictures
  echo '{"centre":{"texels":8,"directions":16,"samples":2}}' >grid.json
}

# make_knitted NAME: a quad in a fabric with yarn.
make_knitted() {
  selvedge make --quality draft plain-weave --set yarn=tube -o yarn.fabric.exr --texels 4 --quiet "${small[@]:2}"
  write_quad plain.gltf
  selvedge dress plain.gltf yarn.fabric.exr -o "$1" --all --quiet
}

# write_pictures NAME: a picture of 3 x 3 repeats, and a table NAME.csv that has it under 24 lights.
write_pictures() {
  node -e 'const [name] = process.argv.slice(1), fs = require("fs");
    const pixel = (x, y) => 40 + ((x % 8) * 37 + (y % 6) * 53 + (x % 8) * (y % 6) * 11) % 180;
    let picture = "P3 24 18 255\n", table = "file,light_x,light_y,light_z,view_x,view_y,view_z\n";
    for (let i = 0; i < 24 * 18; ++i) picture += `${pixel(i % 24, Math.floor(i / 24))} `.repeat(3);
    for (let i = 0; i < 24; ++i) table += `${name}.ppm,${Math.cos(i)},${Math.sin(i)},1,${i / 50},0,1\n`;
    fs.writeFileSync(`${name}.ppm`, picture);
    fs.writeFileSync(`${name}.csv`, table);' "$1"
}

test_help_of_every_verb_has_an_example_that_runs() {
  local example
  make_example_files
  for verb in "${verbs[@]}"; do
    exits 0 selvedge "$verb" --help
    grep -q 'Exit status: 0 good, 1 .*, 2 usage' "$scratch/out" || fail "$verb tells no exit statuses"
    [ "$verb" != make ] || [ "$(fold -w 100 "$scratch/out" | wc -l)" -le 40 ] || fail "make --help is longer than a screen"
    example=$(examples selvedge "$verb")
    [ -n "$example" ] || fail "$verb has no example"
    # At their full size some take a while, and yarn of fibres more so.
    case $verb in
      bake | make) example+=" --set yarn=tube ${small[*]}" ;;
      truth) example+=" --set yarn=tube --size 40x30 --samples 4" ;;
    esac
    bash -c "set -e; $example" >"$scratch/out" 2>"$scratch/err" || fail "$example: $(cat "$scratch/err")"
  done
}

test_help_of_the_viewer_has_examples_that_run() {
  local lines=()
  make_example_files
  cp dressed.glb sweater.glb
  cp k.fabric.exr knit.fabric.exr
  exits 0 selvedge-view --help
  mapfile -t lines < <(examples selvedge-view render)
  [ "${#lines[@]}" -ge 2 ] || fail "render has no examples"
  for example in "${lines[@]}"; do exits 0 $example; done
  [ -s sweater.png ]
  [ -s knit.exr ]
}

test_version_is_the_projects() {
  local version
  version=$(sed -n 's/^project(selvedge VERSION \([0-9.]*\).*/\1/p' "$root/CMakeLists.txt")
  for program in selvedge selvedge-view; do
    [ "$($program --version)" = "$program $version" ] || fail "$program --version: $($program --version)"
  done
  # Python, npm, Debian, the changelog and the citation, where they are there.
  local build=${bin%/bin} found
  found=$(
    grep -m 1 -oE '^## [0-9.]+ - 20[0-9-]+$' "$root/CHANGELOG.md" | cut -d ' ' -f 2
    sed -n 's/^version: //p' "$root/CITATION.cff"
    node -p "require('$root/viewer/web/package.json').version"
    sed -n 's/^set(CPACK_PACKAGE_VERSION "\(.*\)")/\1/p' "$build/CPackConfig.cmake"
    if compgen -G "$build/python/selvedge/core*" >/dev/null; then PYTHONPATH=$build/python /usr/bin/python3 -c 'import selvedge; print(selvedge.__version__)'; fi
  )
  [ "$(sort -u <<<"$found")" = "$version" ] || fail "not all $version: $found"
}

test_a_description_is_read_again_and_set_moves_it() {
  exits 0 selvedge stitch twill -o twill.json --set warp_plies=2 --set weft_albedo=0.5,0.25,0.125
  holds "r.selvedge_stitch === 1 && r.yarns.length === 8 && r.yarns[0].plies === 2 && r.yarns[4].albedo[1] === 0.25" twill.json
  exits 0 selvedge stitch twill.json -o again.json
  same again.json twill.json
  exits 0 selvedge stitch twill --list --json
  holds "r.parameters.some(p => p.name === 'warp_plies' && p.value[0] === 1 && p.range[1] === 8)"
  exits 0 selvedge stitch plain-knit --set yarn=tube --set wale_mm=2.5 --json
  holds "r.periodMm[0] === 2.5 && Math.abs(r.clearanceMm) < 0.012"
}

test_a_weaving_draft_is_a_stitch() {
  write_twill twill.wif 8
  exits 0 selvedge stitch twill.wif --json
  holds "r.periodMm[0] === 4 && r.yarns === 8 && r.remarks[0] === '8 x 8 yarns, smallest repeat 4 x 4'"
  exits 0 selvedge make --quality paper twill.wif --set yarn=tube -o t.fabric.exr --quiet --texels 16 "${small[@]:2}"
  exits 0 selvedge info t.fabric.exr --json
  refuses OPTION_OUT_OF_RANGE 'its yarns need 16x16 texels' selvedge bake twill.wif -o o.exr "${small[@]}"
  # Not asked for a number, it takes what the narrowest yarn needs.
  printf '[WARP SPACING]\n1=0.03\n5=0.03\n' >>twill.wif
  exits 0 selvedge bake twill.wif --set yarn=tube -o t.samples.exr --quiet --views 4 --lights 4 --samples 1 --pairs 0
  exits 0 selvedge info t.samples.exr --json
  holds "JSON.stringify(r).includes('[22,16]')"
}

test_a_knitting_chart_is_a_stitch() {
  printf 'yarn A: albedo=#ffffff\nyarn B: albedo=#ff0000\n2: k8 [A7 B]\n1: k8\n' >dots.txt
  exits 0 selvedge stitch dots.txt --set yarn=tube --json
  holds "Math.abs(r.periodMm[0] - 38) < 2 && r.yarns === 3 && Math.abs(r.clearanceMm) < 0.012"
  holds "r.remarks[0] === 'yarn B floats behind 7 stitches of row 2: knitters catch what is longer than 5'"
  # The built-in stitch, from its chart.
  printf 'name: rib\nyarn A: albedo=0.60,0.53,0.43\n1: k p\n' >rib.txt
  selvedge stitch rib.txt -o of-chart.json --quiet
  selvedge stitch rib -o built-in.json --quiet
  same of-chart.json built-in.json
  exits 0 selvedge make rib.txt --set yarn=tube -o r.fabric.exr --quiet --texels 16 "${small[@]:2}"
  refuses OPTION_OUT_OF_RANGE 'its yarns need 16x4 texels' selvedge bake dots.txt -o o.exr "${small[@]}"
}

# reports PROGRAM VERB COMMAND...: the report is one JSON text with the frame of all reports, and nothing else is said.
reports() {
  local program=$1 verb=$2
  shift 2
  exits 0 "$@" --json
  holds "r.program === '$program' && /^[0-9]+\.[0-9]+\.[0-9]+$/.test(r.version) && r.report === 1 && r.verb === '$verb'"
  [ ! -s "$scratch/err" ] || fail "also says: $(cat "$scratch/err")"
}

test_report_of_every_verb_is_json() {
  reports selvedge stitch selvedge stitch --list
  holds "r.stitches.some(s => s.name === 'plain-knit')"
  reports selvedge stitch selvedge stitch plain-knit --set yarn=tube -o k.ply
  holds "r.triangles > 100 && r.periodMm[0] === 5"
  reports selvedge bake selvedge bake plain-knit --set yarn=tube -o k.samples.exr "${small[@]}"
  holds "r.bytes === $(stat -c %s k.samples.exr) && r.indirect === 'lines' && r.coverage > 0.5 && r.coverage <= 1"
  reports selvedge fit selvedge fit k.samples.exr -o k.fabric.exr
  holds "r.bytes === $(stat -c %s k.fabric.exr) && r.levels.length === 4"
  reports selvedge make selvedge make --quality paper plain-weave --set yarn=tube -o w.fabric.exr "${small[@]}"
  holds "r.bake.samples > 0 && r.fit.output === 'w.fabric.exr'"
  write_quad quad.gltf
  reports selvedge dress selvedge dress quad.gltf k.fabric.exr -o quad.glb --material cloth
  holds "r.materials.length === 1 && r.materials[0].name === 'cloth' && r.bytes === $(stat -c %s quad.glb)"
  reports selvedge plan selvedge plan quad.glb
  holds "r.materials.length === 1 && r.materials[0].seen"
  make_knitted knitted.glb
  reports selvedge export selvedge export knitted.glb -o yarn.glb
  holds "r.yarns.length === 1 && r.triangles > 0 && r.bytes === $(stat -c %s yarn.glb)"
  reports selvedge check selvedge check k.fabric.exr k.samples.exr quad.glb
  reports selvedge info selvedge info k.fabric.exr
  reports selvedge evaluate selvedge evaluate k.fabric.exr --uv 0.5,0.5
  holds "r.rgb.length === 3 && r.alpha >= 0 && r.alpha <= 1"
  reports selvedge compare selvedge compare k.fabric.exr k.samples.exr
  reports selvedge-view render selvedge-view render quad.glb -o quad.png --size 64x64 --quiet
  holds "r.width === 64 && r.fabrics === 1"
}

test_an_error_is_json_where_the_report_would_be() {
  exits 1 selvedge info none.exr --json
  holds "r.verb === 'info' && r.error.code === 'FILE_MISSING' && r.error.file === 'none.exr' && r.error.message !== ''"
  [ ! -s "$scratch/err" ] || fail "also says: $(cat "$scratch/err")"
  exits 1 selvedge-view render none.glb -o o.png --json
  holds "r.program === 'selvedge-view' && r.error.code === 'FILE_MISSING'"
  exits 2 selvedge make plain-knit --json --lobes 99
  holds "r.verb === 'make' && r.error.code === 'USAGE' && r.error.message.includes('--lobes')"
}

test_a_direction_is_the_same_however_long_it_is() {
  make_plane_fabric
  local long
  exits 0 selvedge evaluate plane.fabric.exr --uv 0,0 --light 0,0.6,0.8 --view 1,0,1
  cp "$scratch/out" short
  for long in 1e308 1e-320; do
    exits 0 selvedge evaluate plane.fabric.exr --uv 0,0 --light 0,0.6,0.8 --view $long,0,$long
    same short "$scratch/out"
    exits 0 selvedge truth plane.obj --period 2x2 --samples 2 -o $long.exr --size 8x8 --light $long,0,$long
  done
  exits 0 selvedge truth plane.obj --period 2x2 --samples 2 -o short.exr --size 8x8 --light 1,0,1
  same short.exr 1e308.exr
  same short.exr 1e-320.exr
}

test_the_manual_page_has_every_verb_and_option() {
  local program verb option
  for program in selvedge selvedge-view; do
    $program --man >page.1
    if command -v groff >/dev/null; then
      groff -man -ww -Tutf8 page.1 2>"$scratch/err" >/dev/null
      [ ! -s "$scratch/err" ] || fail "$program: $(cat "$scratch/err")"
    fi
    for verb in $($program --help | sed -n '/^Subcommands:/,/^$/s/^  \([a-z]*\) .*/\1/p'); do
      grep -qF ".SS ${program/-/\\-} $verb" page.1 || fail "no page of $program $verb"
      for option in $($program "$verb" --help | sed -n 's/^  \(-o,\)\{0,1\}\(--[a-z-]*\).*/\2/p'); do
        grep -qF -- "${option//-/\\-}" page.1 || fail "no $option in the page of $program"
      done
    done
  done
}

test_info_is_a_table_that_fits_a_screen() {
  selvedge make plain-knit --set yarn=tube -o k.fabric.exr --quality standard --keep-samples k.samples.exr \
    --quiet "${small[@]}"
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
  local file
  for file in k.fabric.exr k.samples.exr quad.glb; do
    exits 0 selvedge info $file
    [ "$(wc -l <"$scratch/out")" -le 40 ] || fail "$file: $(wc -l <"$scratch/out") lines"
    [ "$(wc -L <"$scratch/out")" -le 100 ] || fail "$file: wider than 100: $(cat "$scratch/out")"
  done
  exits 0 selvedge info k.fabric.exr
  grep -q '^made of .*plain-knit$' "$scratch/out" || fail "$(cat "$scratch/out")"
  grep -qE '^accuracy +[0-9.]+' "$scratch/out" || fail "no held-out errors: $(cat "$scratch/out")"
}

test_progress_is_for_terminals_only() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr "${small[@]}" >out.txt 2>err.txt
  [ ! -s err.txt ] || fail "says without a terminal: $(cat err.txt)"
  if grep -q $'\r' out.txt; then fail "a carriage return on standard output"; fi
  grep -q 'fitted in' out.txt
  # The same on a terminal, which util-linux's script is; a machine without pseudo-terminals has none to try.
  script -qec true /dev/null >/dev/null 2>&1 </dev/null || exit 77
  script -qec "selvedge make --quality paper plain-knit --set yarn=tube \
    -o k.fabric.exr ${small[*]}" /dev/null >terminal.txt </dev/null
  grep -q $'\r\033\[K' terminal.txt || fail "no progress on a terminal"
  script -qec "selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr \
    --quiet ${small[*]}" /dev/null >quiet.txt </dev/null
  [ ! -s quiet.txt ] || fail "--quiet says: $(cat quiet.txt)"
}

test_info_tells_what_is_in_each_kind_of_file() {
  make_plane_fabric
  selvedge dress quad.gltf plane.fabric.exr -o quad.glb --all --quiet
  exits 0 selvedge info plane.fabric.exr --json
  holds "r.kind === 'fabric' && r.content.levels === 4 && r.content.texels.join() === '8,8' && r.content.provenance.bake.seed === 1"
  exits 0 selvedge info plane.samples.exr --json
  holds "r.kind === 'samples' && r.content.views.join() === '4,4' && r.content.mmPerRepeat.join() === '2,2' && r.content.pairs['held-out'] === 8"
  exits 0 selvedge info quad.glb --json
  holds "r.kind === 'gltf' && r.content.triangles === 2 && r.content.materials[0].fabric === 0 && r.content.fabrics.length === 1"
}

# is_text FILE: UTF-8 without control characters but line ends.
is_text() {
  node -e 'const text = new TextDecoder("utf-8", {fatal: true}).decode(require("fs").readFileSync(process.argv[1]));
    if (/[\x00-\x09\x0b-\x1f\x7f-\x9f]/.test(text)) throw new Error("control characters");' "$1"
}

test_bytes_that_are_no_text_are_escaped_in_messages_and_reports() {
  make_plane_fabric
  local odd=$'n\xffme\e[31m'
  # In the file's name, in JSON, in the names of an EXR file's parts, in a material's name.
  printf '{"asset":{"version":"2.0","generator":"\xff\x1b[2J"}}' >bad.gltf
  cp bad.gltf "$odd.gltf"
  sed 's/frame.nx/fr\xffme.nx/' plane.fabric.exr >bad.exr
  differ plane.fabric.exr bad.exr
  sed 's/"cloth"/"clo\\u001b[31mth"/' quad.gltf >named.gltf
  for file in bad.gltf "$odd.gltf" bad.exr; do
    exits 1 selvedge check "$file"
    is_text "$scratch/err"
    cp "$scratch/err" said
    exits 1 selvedge check "$file" --json
    is_text "$scratch/err"
    is_text "$scratch/out"
    holds "r.good === false"
    # Names that are no text are not taken from an EXR file at all, and nothing is quoted of what is no JSON.
    [ "$file" = "$odd.gltf" ] || continue
    grep -qE '\\x(FF|1B)' said || fail "no escape: $(cat said)"
    holds "/\\\\x(FF|1B)/.test(JSON.stringify(r.files[0].issues))"
  done
  exits 0 selvedge dress named.gltf plane.fabric.exr -o named.glb --all
  is_text "$scratch/out"
  cp plane.fabric.exr "$odd.exr"
  exits 0 selvedge dress quad.gltf "$odd.exr" -o "$odd.glb" --all
  is_text "$scratch/out"
  exits 0 selvedge check "$odd.glb" "$odd.exr" --json
  is_text "$scratch/out"
  exits 0 selvedge info "$odd.exr" --json
  is_text "$scratch/out"
  exits 0 selvedge bake plane.obj --period 2x2 -o "$odd.samples.exr" "${small[@]}"
  is_text "$scratch/out"
}

"$2"

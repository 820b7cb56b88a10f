# shellcheck shell=bash disable=SC2034
# What the tests of the command line have in common. Sourced by scripts that are run as SCRIPT BIN CASE: BIN is the folder of
# the programs, CASE the name of a function of the script. Each run has a folder of its own, which it works in and
# which is gone afterwards; Node.js reads the JSON reports (without it a test is skipped, status 77).
set -Eeuo pipefail
command -v node >/dev/null || exit 77
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/../.." && pwd)
bin=$(cd "$1" && pwd)
PATH=$bin:$PATH
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
trap 'echo "line $LINENO of ${BASH_SOURCE[0]##*/} failed: $BASH_COMMAND" >&2' ERR
mkdir "$scratch/work"
cd "$scratch/work"

# Sizes that take fractions of a second and still use every part of the road.
small=(--texels 8 --views 16 --lights 16 --samples 4 --pairs 8 --truth-samples 8)

fail() {
  echo "$*" >&2
  exit 1
}

# exits STATUS COMMAND...: runs it with its output in $scratch/out and $scratch/err.
exits() {
  local wanted=$1 status=0
  shift
  "$@" >"$scratch/out" 2>"$scratch/err" || status=$?
  [ "$status" = "$wanted" ] || fail "status $status, not $wanted, of: $*: $(cat "$scratch/err")"
}

# Names and contents of everything in the working folder.
snapshot() { find . -printf '%y %p\n' -type f -exec cksum {} + | sort; }

# refuses CODE TEXT COMMAND...: exit status 1, one line on standard error with TEXT (a file's name, mostly) and
# [CODE], nothing on standard output, and the working folder as it was.
refuses() {
  local code=$1 text=$2 before
  shift 2
  before=$(snapshot)
  exits 1 "$@"
  [ "$(wc -l <"$scratch/err")" = 1 ] || fail "not one line from: $*: $(cat "$scratch/err")"
  grep -qF -- "$text" "$scratch/err" || fail "no \"$text\" from: $*: $(cat "$scratch/err")"
  grep -qE "^selvedge(-view)?: .+ \[$code\]$" "$scratch/err" || fail "no [$code] from: $*: $(cat "$scratch/err")"
  [ ! -s "$scratch/out" ] || fail "standard output of a refusal: $*: $(cat "$scratch/out")"
  [ "$before" = "$(snapshot)" ] || fail "left something behind: $*: $(diff <(echo "$before") <(snapshot))"
}

# holds EXPRESSION [FILE]: a JavaScript expression is true of `r`, the JSON in FILE or the last command's output.
holds() {
  node -e 'const r = JSON.parse(require("fs").readFileSync(process.argv[1], "utf8"));
    if (eval(process.argv[2]) !== true) { console.error(JSON.stringify(r, null, 1)); process.exit(1); }' \
    "${2:-$scratch/out}" "$1" || fail "does not hold: $1"
}

# Whether the programs are built with the address sanitizer, which takes terabytes of addresses.
sanitized() { grep -q __asan_init "$bin/selvedge"; }

same() { cmp "$1" "$2" || fail "$1 and $2 differ"; }
differ() { ! cmp -s "$1" "$2" || fail "$1 and $2 have the same bytes"; }

# cut_short FILE SHORT: all but the last quarter of it.
cut_short() { head -c $(($(stat -c %s "$1") * 3 / 4)) "$1" >"$2"; }

# A square of 2 x 2 mm, flat: without neighbours to shade it, it is exactly Lambert.
write_plane() { printf 'v %s\n' '0 0 0' '2 0 0' '2 2 0' '0 2 0' >"$1" && echo 'f 1 2 3 4' >>"$1"; }

# A fabric of that plane with the albedo 0.8, 0.4, 0.2, its samples, and quad.gltf, which may wear it.
make_plane_fabric() {
  write_quad quad.gltf
  write_plane plane.obj
  selvedge make --quality paper plane.obj --period 2x2 --albedo 0.8,0.4,0.2 -o plane.fabric.exr --keep-samples plane.samples.exr \
    --quiet "${small[@]}"
}

# write_twill FILE YARNS: a 2/2 twill of YARNS x YARNS yarns, 1 mm apart, that repeats after 4.
write_twill() {
  {
    printf '[WIF]\n[WEAVING]\nShafts=4\n'
    for system in WARP WEFT; do printf '[%s]\nThreads=%d\nUnits=Centimeters\nSpacing=0.1\nThickness=0.06\n' $system "$2"; done
    echo '[THREADING]'
    for ((i = 1; i <= $2; ++i)); do echo "$i=$(((i - 1) % 4 + 1))"; done
    echo '[LIFTPLAN]'
    for ((i = 1; i <= $2; ++i)); do echo "$i=$(((i - 1) % 4 + 1)),$((i % 4 + 1))"; done
  } >"$1"
}

# write_quad FILE.gltf [ATTRIBUTES]: a square of 0.1 x 0.1 m in the plane z = 0, facing +z, with one unit of
# texture coordinates and the materials "cloth", which it has, and "spare", which nothing has.
write_quad() {
  node -e 'const data = Buffer.alloc(140);
    const corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    corners.forEach(([x, y], i) => {
      [x / 10, y / 10, 0].forEach((v, k) => data.writeFloatLE(v, 12 * i + 4 * k));
      [0, 0, 1].forEach((v, k) => data.writeFloatLE(v, 48 + 12 * i + 4 * k));
      [x, 1 - y].forEach((v, k) => data.writeFloatLE(v, 96 + 8 * i + 4 * k));
    });
    const indices = Buffer.from(new Uint16Array([0, 1, 2, 0, 2, 3]).buffer);
    const all = {POSITION: 0, NORMAL: 1, TEXCOORD_0: 2};
    const attributes = Object.fromEntries(process.argv[2].split(" ").map(name => [name, all[name]]));
    const bytes = Buffer.concat([data.subarray(0, 128), indices]);
    require("fs").writeFileSync(process.argv[1], JSON.stringify({
      asset: {version: "2.0"}, scene: 0, scenes: [{nodes: [0]}], nodes: [{mesh: 0}],
      meshes: [{primitives: [{attributes, indices: 3, material: 0}]}],
      materials: [{name: "cloth", doubleSided: true}, {name: "spare"}],
      buffers: [{byteLength: bytes.length, uri: "data:application/octet-stream;base64," + bytes.toString("base64")}],
      bufferViews: [[0, 48, 34962], [48, 48, 34962], [96, 32, 34962], [128, 12, 34963]].map(
        ([byteOffset, byteLength, target]) => ({buffer: 0, byteOffset, byteLength, target})),
      accessors: [
        {bufferView: 0, componentType: 5126, count: 4, type: "VEC3", min: [0, 0, 0], max: [Math.fround(0.1), Math.fround(0.1), 0]},
        {bufferView: 1, componentType: 5126, count: 4, type: "VEC3"},
        {bufferView: 2, componentType: 5126, count: 4, type: "VEC2"},
        {bufferView: 3, componentType: 5123, count: 6, type: "SCALAR"}]
    }));' "$1" "${2:-POSITION NORMAL TEXCOORD_0}"
}

# Writes slide.gltf: the square, whose clip "slide" moves it by 0.05 m along x in two seconds, or as many as are given.
write_slide() {
  write_quad quad.gltf
  node -e 'const fs = require("fs"); const g = JSON.parse(fs.readFileSync("quad.gltf")), seconds = Number(process.argv[1]);
    const data = Buffer.from(new Float32Array([0, seconds, 0, 0, 0, 0.05, 0, 0]).buffer);
    g.buffers.push({ byteLength: 32, uri: "data:;base64," + data.toString("base64") });
    const buffer = g.buffers.length - 1;
    const view = g.bufferViews.push({ buffer, byteLength: 8 }, { buffer, byteOffset: 8, byteLength: 24 }) - 2;
    const input = g.accessors.push({ bufferView: view, componentType: 5126, count: 2, type: "SCALAR", min: [0], max: [seconds] },
      { bufferView: view + 1, componentType: 5126, count: 2, type: "VEC3" }) - 2;
    g.animations = [{ name: "slide", samplers: [{ input, output: input + 1 }],
      channels: [{ sampler: 0, target: { node: 0, path: "translation" } }] }];
    fs.writeFileSync("slide.gltf", JSON.stringify(g));' "${1:-2}"
}

# edited IN.gltf OUT.gltf STATEMENT: with the JSON as `g`.
edited() {
  node -e 'const fs = require("fs"), g = JSON.parse(fs.readFileSync(process.argv[1]));
    eval(process.argv[3]);
    fs.writeFileSync(process.argv[2], JSON.stringify(g));' "$@"
}

# A base colour texture from a URI.
picture_from() {
  echo "g.images = [{uri: '$1'}]; g.textures = [{source: 0}];
    g.materials[0].pbrMetallicRoughness = {baseColorTexture: {index: 0}};"
}

# JavaScript that makes PNG files of chunks, such as png(head(8, 8), zeros(8, 8), end): grey of one bit, unless the head
# says otherwise.
png_writer='const zlib = require("zlib");
  const chunk = (name, data) => {
    const all = Buffer.concat([Buffer.from(name), data]), size = Buffer.alloc(4), sum = Buffer.alloc(4);
    const table = [...Array(256).keys()].map(n => { for (let k = 0; k < 8; ++k) n = n & 1 ? 0xEDB88320 ^ n >>> 1 : n >>> 1; return n; });
    let crc = -1;
    for (const byte of all) crc = table[(crc ^ byte) & 255] ^ crc >>> 8;
    size.writeUInt32BE(data.length), sum.writeInt32BE(~crc);
    return Buffer.concat([size, all, sum]);
  };
  const head = (width, height, bits = 1, colours = 0) => {
    const data = Buffer.from([0, 0, 0, 0, 0, 0, 0, 0, bits, colours, 0, 0, 0]);
    data.writeUInt32BE(width), data.writeUInt32BE(height, 4);
    return chunk("IHDR", data);
  };
  const zeros = (width, height) =>
    chunk("IDAT", zlib.deflateSync(Buffer.alloc((Math.ceil(width / 8) + 1) * height), {level: 9}));
  const end = chunk("IEND", Buffer.alloc(0));
  const png = (...chunks) => Buffer.concat([Buffer.from("\x89PNG\r\n\x1a\n", "latin1"), ...chunks]);'

# make_scene: a fabric, and a square that wears it.
make_scene() {
  selvedge make --quality paper plain-knit --set yarn=tube -o k.fabric.exr --quiet "${small[@]}" >/dev/null
  write_quad quad.gltf
  selvedge dress quad.gltf k.fabric.exr -o quad.glb --all --quiet
}

// Light from all around as fabrics are drawn in it, a few lamps and smooth light: the twin of
// format/picture/environment.cpp and of the functions of format/fabric/smooth_light.h.
//
// Pictures are { width, height, radiance }, twice as wide as high: red, green, blue of each pixel, the top row (+y) first,
// the middle column seen along -z, the column a quarter to the right along +x.
const {PI, cos, floor, hypot, max, sin} = Math;
const MOST_WIDTH = 512, LAMP_COSINE = cos(20 * PI / 180), LAMP_BRIGHTNESS = 4, LEAST_LAMP = 0.01;
export const MAX_LAMPS = 4;
/** Integrals of the clamped cosine and the nine functions. */
export const SMOOTH_LIGHT_INTEGRALS = [1, 2 / 3, 2 / 3, 2 / 3, 1 / 4, 1 / 4, 1 / 4, 1 / 4, 1 / 4].map((weight) => weight * Math.PI);

/** Values of the nine functions of a unit direction, and the integrals of their squares. */
export const smooth_basis = (x, y, z) => [1, x, y, z, x * y, x * z, y * z, x * x - y * y, 3 * z * z - 1];
const NORMS = [1, 1 / 3, 1 / 3, 1 / 3, 1 / 15, 1 / 15, 1 / 15, 4 / 15, 4 / 5].map((weight) => 4 * PI * weight);

const solid_angle = ({width, height}, y) => 2 * PI / width * (cos(y * PI / height) - cos((y + 1) * PI / height));
const brightness = (r, g, b) => (r + g + b) / 3;
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** Calls body(place in radiance, direction, solid angle) for each pixel; the direction is an array that is used again. */
function each(picture, body) {
  const {width, height} = picture, direction = [0, 0, 0];
  const columns = Array.from({length: width}, (_, x) => ((x + 0.5) / width - 0.5) * 2 * PI);
  const [sines, cosines] = [columns.map(sin), columns.map(cos)];
  for (let y = 0, at = 0; y < height; ++y) {
    const polar = (y + 0.5) / height * PI, planar = sin(polar), angle = solid_angle(picture, y);
    direction[1] = cos(polar);
    for (let x = 0; x < width; ++x, at += 3) {
      direction[0] = sines[x] * planar;
      direction[2] = -cosines[x] * planar;
      body(at, direction, angle);
    }
  }
}

/** The mean over areas; the picture itself if it is not larger. */
function reduced(picture, width) {
  if (picture.width <= width) return picture;
  const height = width / 2, radiance = new Float32Array(3 * width * height), weights = new Float64Array(width * height);
  for (let y = 0; y < picture.height; ++y) {
    const weight = solid_angle(picture, y), row = floor(y * height / picture.height) * width;
    for (let x = 0; x < picture.width; ++x) {
      const to = row + floor(x * width / picture.width), from = 3 * (y * picture.width + x);
      for (let c = 0; c < 3; ++c) radiance[3 * to + c] += picture.radiance[from + c] * weight;
      weights[to] += weight;
    }
  }
  weights.forEach((weight, i) => {
    for (let c = 0; c < 3; ++c) radiance[3 * i + c] /= weight;
  });
  return {width, height, radiance};
}

/** The same picture in smaller pixels, if they are so large that their middles do not stand for them; always a copy. */
function enlarged(picture) {
  const factor = max(1, floor(256 / picture.width)), width = picture.width * factor, height = picture.height * factor;
  const radiance = new Float32Array(3 * width * height);
  for (let y = 0, at = 0; y < height; ++y)
    for (let x = 0; x < width; ++x)
      for (let c = 0; c < 3; ++c)
        radiance[at++] = picture.radiance[3 * (floor(y / factor) * picture.width + floor(x / factor)) + c];
  return {width, height, radiance};
}

/** The middle of the lamp that sends most, of what is brighter than `least`. */
function strongest_part(picture, least) {
  const coarse = reduced(picture, 128), bright = [];
  each(coarse, (at, direction, angle) => {
    const excess = brightness(...coarse.radiance.subarray(at, at + 3)) - least;
    if (excess > 0) bright.push({direction: [...direction], power: excess * angle});
  });
  let strongest = null, most = 0;
  for (const middle of bright) {
    let power = 0;
    for (const part of bright) power += dot(part.direction, middle.direction) > LAMP_COSINE ? part.power : 0;
    if (power <= most) continue;
    most = power;
    strongest = middle.direction;
  }
  return strongest;
}

/** What light of unit radiance from a direction and a solid angle adds to the factors of smooth light. */
export const smooth_factors = (basis, solid) => basis.map((value, k) => value * solid / NORMS[k]);

/** Bright parts of a picture, and the picture without them: { lamps: [{ direction, irradiance }], rest }. */
export function extract_lamps(picture) {
  const rest = enlarged(reduced(picture, MOST_WIDTH)), {radiance} = rest, lamps = [], whole = [0, 0, 0];
  each(rest, (at, _, angle) => {
    for (let c = 0; c < 3; ++c) whole[c] += radiance[at + c] * angle;
  });
  let left = whole;
  while (lamps.length < MAX_LAMPS) {
    const mean = left.map((x) => x / (4 * PI)), least = LAMP_BRIGHTNESS * brightness(...mean);
    const towards = strongest_part(rest, least);
    if (!towards) break;
    const irradiance = [0, 0, 0], middle = [0, 0, 0], places = [];
    each(rest, (at, direction, angle) => {
      if (!(dot(direction, towards) > LAMP_COSINE)) return;
      if (!(brightness(radiance[at], radiance[at + 1], radiance[at + 2]) > least)) return;
      places.push(at);
      const excess = mean.map((x, c) => (radiance[at + c] - x) * angle);
      for (let k = 0; k < 3; ++k) {
        irradiance[k] += excess[k];
        middle[k] += direction[k] * brightness(...excess);
      }
    });
    if (brightness(...irradiance) < LEAST_LAMP * brightness(...whole)) break;
    for (const at of places) radiance.set(mean, at);
    left = left.map((x, c) => x - irradiance[c]);
    const length = hypot(...middle);
    lamps.push({direction: middle.map((x) => x / length), irradiance});
  }
  return {lamps, rest};
}

/** Smooth light of a picture: nine factors, each a colour. */
export function project_to_smooth_light(picture) {
  const factors = NORMS.map(() => [0, 0, 0]), {radiance} = picture;
  each(picture, (at, direction, angle) => {
    smooth_factors(smooth_basis(...direction), angle).forEach((weight, k) => {
      for (let c = 0; c < 3; ++c) factors[k][c] += radiance[at + c] * weight;
    });
  });
  return factors;
}

/** Divides a picture: { lamps, rest }, the rest as smooth light. */
export function split_light(picture) {
  const {lamps, rest} = extract_lamps(picture);
  return {lamps, rest: project_to_smooth_light(rest)};
}

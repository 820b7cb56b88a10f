// Light from all around (spec/brdf.md, "Environments"): the twin of format/fabric/smooth_light.h and of the hybrid path's
// lamps, held to them by tests. The includer sets both variables for the pixel.
vec3 around[9];  // factors of the functions, in the fabric's frame
uint sky;        // place of the fabric's sky: the places of the integrals of its products' psi_b, and of sky_of() its yarn
const uint sky_of_through = 2u;  // then that of the integrals of what comes through,
const uint sky_of_turned = 3u;   // and the same three of the fabric from behind

float[9] smooth_basis(vec3 d) {
  return float[9](1.0, d.x, d.y, d.z, d.x * d.y, d.x * d.z, d.y * d.z, d.x * d.x - d.y * d.y, 3.0 * d.z * d.z - 1.0);
}

// Brings `around` from world axes to those of a frame. The part of degree 2 is d^T Q d.
vec3[3] times_q(vec3 a) {
  vec3 xx = around[7] - around[8];
  vec3 yy = -around[7] - around[8];
  vec3 zz = 2.0 * around[8];
  return vec3[3](xx * a.x + 0.5 * (around[4] * a.y + around[5] * a.z),
                 yy * a.y + 0.5 * (around[4] * a.x + around[6] * a.z),
                 zz * a.z + 0.5 * (around[5] * a.x + around[6] * a.y));
}
vec3 along_axis(vec3 a, vec3 p[3]) { return p[0] * a.x + p[1] * a.y + p[2] * a.z; }
void turn_around_into(mat3 frame) {
  vec3 linear[3] = vec3[3](around[1], around[2], around[3]);
  vec3 of_x[3] = times_q(frame[0]);
  vec3 of_y[3] = times_q(frame[1]);
  vec3 of_z[3] = times_q(frame[2]);
  for (int k = 0; k < 3; ++k) around[1 + k] = along_axis(frame[k], linear);
  around[4] = 2.0 * along_axis(frame[0], of_y);
  around[5] = 2.0 * along_axis(frame[0], of_z);
  around[6] = 2.0 * along_axis(frame[1], of_z);
  around[7] = 0.5 * (along_axis(frame[0], of_x) - along_axis(frame[1], of_y));
  around[8] = 0.5 * along_axis(frame[2], of_z);
}

// What white reflects that faces along n.
vec3 mean_of(vec3 factors[9], vec3 n) {
  float basis[9] = smooth_basis(n);
  vec3 sum = vec3(0.0);
  for (int k = 0; k < 9; ++k) sum += factors[k] * (basis[k] * (k == 0 ? 1.0 : k < 4 ? 2.0 / 3.0 : 0.25));
  return max(sum, vec3(0.0));
}
float visible_share(vec3 seen, vec3 all) {
  float sum = all.x + all.y + all.z;
  return sum > 0.0 ? clamp((seen.x + seen.y + seen.z) / sum, 0.0, 1.0) : 1.0;
}

// The same light as twelve lamps at fixed directions of the frame: for what has no integrals.
const uint around_lamps = 12u;
void around_lamp(uint i, out vec3 direction, out vec3 irradiance) {
  const float two_pi = 6.28318530717958648;
  uint ring = i < 4u ? 0u : i < 9u ? 1u : 2u;
  uint first = uint[3](0u, 4u, 9u)[ring];
  float z = float[3](0.112701665, 0.5, 0.887298335)[ring];
  float count = float[3](4.0, 5.0, 3.0)[ring];
  float angle = two_pi * (float(i - first) + z) / count;
  direction = vec3(sqrt(1.0 - z * z) * vec2(cos(angle), sin(angle)), z);
  float basis[9] = smooth_basis(direction);
  irradiance = vec3(0.0);
  for (int k = 0; k < 9; ++k) irradiance += around[k] * basis[k];
  irradiance *= two_pi * (ring == 1u ? 8.0 : 5.0) / (18.0 * count);
}

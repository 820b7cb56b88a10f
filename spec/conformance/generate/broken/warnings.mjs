// Fabric files that are legal but unwise.
import {base, everywhere, lobe, opacity_on_0} from './common.mjs';

const warning = (code, what, about, place, changes) => ({...base, name: `${code}-${what}`, about, issues: [{code, place}], ...changes});

export const unwise_fabrics = [
  warning('FABRIC_PEAK', 'exponent-in-half', 'an exponent of 500 in half precision', 'lobes', {
    layers: {lobes: {precision: 'half'}}, K: 1,
    value: {lobes: lobe({rho: 0.125, z: 0.9375, n: 500})},
  }),
  warning('FABRIC_PEAK', 'beyond-half', 'a peak of 265,000, brought down by the table', 'lobes', {
    layers: ['lobes', 'table'], K: 1,
    value: {lobes: lobe({rho: 0.125, z: 1.0025, n: 5000}), table: everywhere(2 ** -12)},
  }),
  warning('FABRIC_ENERGY', 'rho', 'rho = 2: more than six times the light comes back', 'level 0', {
    value: {lobes: lobe({rho: 2}), opacity: everywhere(1)},
  }),
  warning('FABRIC_ENERGY', 'one-texel', 'rho = 0.5 at one texel: half as much again as it receives', 'level 0', {
    value: {
      lobes: (level, channel, t) => channel.startsWith('lobes.diffuse') && level + t === 0 ? 0.5 : 0.1,
      opacity: everywhere(1)
    },
  }),
  warning('FABRIC_ENERGY', 'oblique-light', 'more light comes back than falls on it from 60 degrees, not from above', 'level', {
    K: 1,
    value: {lobes: lobe({rho: 0.2, xy: -1.2, z: 0.3, n: 2}), opacity: everywhere(1)},
  }),
  warning('FABRIC_ENERGY', 'no-lobes', 'no lobes: f = l_z, and pi times the light comes back', 'level', {
    layers: ['opacity'],
    value: {opacity: everywhere(1)},
  }),
  warning('FABRIC_LEVELS', 'chain', 'two of four levels', '/levels', {texels: [8, 4], levels: 2}),
  warning('FABRIC_LEVELS', 'layer', 'opacity at level 0 only', '/layers/opacity', opacity_on_0),
];

// The valid fabrics with more sides than the front; in the form of fabrics.mjs.
import {crossing, crossing_hairs, crossing_strands, plied} from './yarns.mjs';

const PAPER = ['lobes', 'frame', 'table', 'opacity'];

export const sides = [
  {
    name: 'sides-all',
    about: 'the four cases of view and light, each with layers, grids and a scale of its own',
    layers: PAPER,
    sides: {
      'back': {layers: PAPER, grid: [3, 2], K: 2, radianceScale: 0.5},
      'through': {layers: ['lobes', 'table', 'light']},
      'back.through': {layers: ['products', 'bases'], grid: [3, 2], radianceScale: 0.25},
    },
  },
  {
    name: 'sides-through',
    about: 'light that comes through, and no back: the front from behind, in a mirror',
    layers: ['lobes', 'opacity'],
    sides: {through: {layers: ['lobes']}},
  },
  {
    name: 'sides-back',
    about: 'a back that lets no light through',
    layers: ['lobes'],
    sides: {back: {layers: ['lobes', 'table', 'opacity'], grid: [1, 3]}},
  },
  {
    name: 'sides-back-and-through',
    about: 'a back, and light through it as through the front',
    layers: ['lobes', 'opacity'],
    sides: {back: {layers: ['lobes', 'opacity']}, through: {layers: ['lobes', 'table']}},
  },
  {
    name: 'sides-back-of-other-views',
    about: 'a back of other views than the front, to which nothing comes through',
    layers: ['lobes', 'opacity'],
    sides: {back: {layers: ['lobes', 'opacity'], grid: [1, 3]}, through: {layers: ['lobes', 'table']}},
  },
  {
    name: 'sides-left-out',
    about: 'levels that leave a side out, of texels that do not halve',
    texels: [10, 5], layers: ['lobes', 'opacity'],
    sides: {
      'back': {layers: {lobes: {levels: [1, 3]}, opacity: {levels: [1]}}},
      'through': {layers: {lobes: {levels: [3]}, table: {levels: [2, 3]}}},
      'back.through': {layers: {products: {levels: [2, 3]}, bases: {}}},
    },
  },
  {
    ...crossing,
    name: 'sides-yarns',
    about: 'yarn turned over, with light from both sides',
    sides: {back: {layers: ['lobes']}, through: {layers: ['lobes', 'yarns', 'indirect']}},
  },
  {
    ...plied,
    name: 'sides-yarns-plies',
    about: 'plies turned over, one of an axis that begins upright',
    sides: {back: {layers: ['lobes']}, through: {layers: ['lobes', 'yarns', 'indirect']}},
  },
  {
    ...crossing,
    name: 'sides-yarns-dark',
    about: 'yarn turned over, of which no light through it is known',
    sides: {back: {layers: ['lobes']}, through: {layers: ['lobes']}},
  },
  {
    ...crossing_hairs,
    name: 'sides-yarns-hairs',
    about: 'hairs and thick places of yarn turned over, lying and upright, with plies and without',
    sides: {back: {layers: ['lobes']}, through: {layers: ['lobes', 'yarns', 'indirect']}},
  },
  {
    ...crossing_strands,
    name: 'sides-yarns-strands',
    about: 'yarn of strands turned over, lying and upright',
    sides: {back: {layers: ['lobes']}, through: {layers: ['lobes', 'yarns', 'indirect']}},
  },
];

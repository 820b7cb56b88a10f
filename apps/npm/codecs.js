// What the program unpacks and packs by libraries of others.
import { deflate, inflate } from 'pako';
import { MeshoptDecoder } from 'meshoptimizer/decoder';

export const codecs = { inflate, deflate: (bytes, level) => deflate(bytes, { level }), meshopt: MeshoptDecoder };

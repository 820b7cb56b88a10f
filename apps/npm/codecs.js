// Libraries of others by which the program unpacks and packs.
import { deflate, inflate } from 'pako';
import { MeshoptDecoder } from 'meshoptimizer/decoder';
import { MeshoptEncoder } from 'meshoptimizer/encoder';

export const codecs = { inflate, deflate: (bytes, level) => deflate(bytes, { level }), meshopt: MeshoptDecoder, encoder: MeshoptEncoder };

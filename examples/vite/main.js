// The script of a page that Vite or esbuild bundles; sweater.glb is a garment of `selvedge dress`.
import {show} from '../three.js';

globalThis.stage = await show('sweater.glb', document.body);

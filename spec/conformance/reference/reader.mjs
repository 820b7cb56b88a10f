// The kit shares the reader of the package for browsers; in the installed archive it lies in a folder beside.
export * from '../../../viewer/web/reader/index.js';

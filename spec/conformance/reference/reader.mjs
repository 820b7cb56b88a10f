// The kit uses the reader of the package for browsers, which the installed archive has in a folder beside.
export * from '../../../viewer/web/reader/index.js';

// Vite finds the worker and the module by their addresses, also while it serves, if it leaves the package as it is.
export default {base: './', optimizeDeps: {exclude: ['selvedge']}, build: {target: 'es2022'}};

#!/usr/bin/env node
import { node_host, plain_word } from './node.js';
import { run } from './run.js';
process.exitCode = await run(process.argv.slice(2).map((word) => plain_word(word)), node_host());

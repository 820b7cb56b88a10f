// The worker of background.js: takes { id, source }, gives { id, result } of load_words() or { id, issue }.
import {issue_of, load_words} from './load.js';

globalThis.onmessage = async ({data: {id, source}}) => {
  try {
    const result = await load_words(source);
    postMessage({id, result}, [(result.words ?? result.sky).buffer]);
  } catch (error) {
    const {code, place, message} = issue_of(error);
    postMessage({id, issue: [code, place, message]});
  }
};

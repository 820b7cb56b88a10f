// The worker of background.js: takes { id, source }, gives { id, step } for each step of load_words(), then { id, issue }.
import {issue_of, load_words} from './load.js';

globalThis.onmessage = async ({data: {id, source}}) => {
  let issue = null;
  try {
    for await (const step of load_words(source)) postMessage({id, step}, [(step.words ?? step.sky).buffer]);
  } catch (error) {
    const {code, place, message} = issue_of(error);
    issue = [code, place, message];
  }
  postMessage({id, issue});
};

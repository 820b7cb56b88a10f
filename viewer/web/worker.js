// The worker of background.js.
import {CellWorker} from './cell_worker.js';

const worker = new CellWorker((message, transfer) => postMessage(message, transfer));
globalThis.onmessage = ({data}) => worker.receive(data);
postMessage({kind: 'ready'});

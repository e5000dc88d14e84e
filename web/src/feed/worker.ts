// The page's worker: the socket, reading what comes, and the way of thousands of bodies between two frames. So the page's
// own thread, which draws, only passes finished poses on.
//
// Poses are for the time of the next picture, which the page expects. They are sent with each frame, since a page that is
// busy with a picture draws the newest that has come by the next one, and after each picture has begun.

import { Playout } from '../world/playout.ts';
import { Kind } from '../protocol/messages.ts';
import { Connection } from './connection.ts';
import type { Poses, ToPage, ToWorker } from './messages.ts';
import { Motion } from './motion.ts';

const SOONEST_S = 0.004; // a page draws no sooner after it was sent something
const SPARE = 8; // poses that are kept to be written anew

const motion = new Motion();
const spare: Poses[] = [];
let playout = new Playout();
let connection: Connection | null = null;
let link = 0;
let origin_ms = performance.timeOrigin;
let next_s = 0;

// The page's clock.
const clock = () => (performance.timeOrigin - origin_ms + performance.now()) / 1000;

const scope = self as unknown as { postMessage(message: ToPage, transfer?: Transferable[]): void; onmessage: ((event: MessageEvent<ToWorker>) => void) | null };

function post(message: ToPage, poses?: Poses): void {
  scope.postMessage(message, poses ? [poses.shown.buffer] : []);
}

// As they will be when the page draws next.
function poses(now_s: number): Poses {
  motion.interpolate(playout.fraction(Math.max(now_s + SOONEST_S, next_s)));
  const { shown, moving_count: moving } = motion;
  const free = spare.pop();
  if (!free || free.shown.length !== shown.length) return { shown: shown.slice(), moving };
  free.shown.set(shown);
  free.moving = moving;
  return free;
}

function open(path: string): void {
  connection?.close();
  motion.clear();
  playout = new Playout();
  const of = link;
  connection = new Connection(path, {
    binary: (message) => {
      if (message.kind !== Kind.frame) {
        if (message.kind === Kind.welcome) motion.clear();
        post({ link: of, told: 'message', message });
        return;
      }
      const now_s = clock();
      const told = motion.apply(message, playout.fraction(now_s));
      playout.arrived(message.time, now_s);
      const ready = poses(now_s);
      post({ link: of, told: 'message', message: told, poses: ready }, ready);
    },
    json: (message) => post({ link: of, told: 'json', message }),
    changed: (state) => post({ link: of, told: 'state', state }),
    ready: (ready) => post({ link: of, told: 'ready', ready }),
  }, clock);
}

scope.onmessage = ({ data: message }) => {
  switch (message.do) {
    case 'open':
      ({ link, origin_ms } = message);
      open(message.path);
      return;
    case 'close':
      connection?.close();
      connection = null;
      return;
    case 'retry':
      connection?.retryNow();
      return;
    case 'send':
      connection?.send(message.text);
      return;
    case 'fail':
      connection?.fail(message.why);
      return;
    case 'draw':
      next_s = message.next_s;
      spare.push(...message.done.slice(0, SPARE - spare.length));
      if (motion.moving_count > 0) {
        const ready = poses(clock());
        post({ link, told: 'poses', poses: ready }, ready);
      }
  }
};

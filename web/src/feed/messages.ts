// All that the page and its worker say to each other. The worker holds the socket, reads what comes and moves the bodies; the
// page is given what it draws, and passes on what it has to say.

import type { Appeared, BinaryMessage, Frame, JsonMessage } from '../protocol/messages.ts';
import type { LinkState } from './connection.ts';

// A frame as the page needs it: bodies have the slots that both sides give them alike.
export interface FrameTold extends Pick<Frame, 'kind' | 'tick' | 'time' | 'paused' | 'limited' | 'vanished'> {
  appeared: Appeared[];
  owners: number[]; // slot, owner, slot, owner, ...
  states: number[]; // slot, state, ...
}

// They travel to the page, and come back to be written anew.
export interface Poses {
  shown: Float32Array<ArrayBuffer>; // POSE_PARTS for each slot
  moving: number; // bodies on their way
}

export type Told = Exclude<BinaryMessage, Frame> | FrameTold;

export type ToWorker =
  | { do: 'open'; link: number; path: string; origin_ms: number } // origin_ms: the page's performance.timeOrigin
  | { do: 'close' }
  | { do: 'retry' }
  | { do: 'send'; text: string }
  | { do: 'fail'; why: string } // a message that the page could not take
  // A picture begins, and the next is likely at next_s; the poses are shown no more.
  | { do: 'draw'; next_s: number; done: Poses[] };

// `link` is that of the `open` that it belongs to.
export type ToPage = { link: number } & (
  | { told: 'state'; state: LinkState }
  | { told: 'ready'; ready: boolean } // whether the gateway can be sent something
  | { told: 'message'; message: Told; poses?: Poses }
  | { told: 'json'; message: JsonMessage }
  | { told: 'poses'; poses: Poses }
);

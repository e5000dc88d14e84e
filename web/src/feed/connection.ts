// Connection: the WebSocket to the gateway. It reconnects by itself, waiting longer each time, and says what it does.
// Where no time helps it stays as it is, until somebody asks for another try.

import { type BinaryMessage, type JsonMessage, PROTOCOL } from '../protocol/messages.ts';
import { decode } from '../protocol/decode.ts';

const FIRST_WAIT_S = 0.5;
const LONGEST_WAIT_S = 8;
const SILENCE_S = 6; // status comes every second: a socket that is silent for longer is dead

export type LinkState =
  | { state: 'connecting' }
  | { state: 'open' }
  | { state: 'waiting'; again_at_s: number; why: string; code: string }  // again_at_s Infinity: not by itself

// Codes of what stays so.
const FINAL = new Set(['ended', 'failed', 'damaged', 'no_recording']);

export interface ConnectionListener {
  binary(message: BinaryMessage): void;
  json(message: JsonMessage): void;
  changed(state: LinkState): void;
  ready(ready: boolean): void; // whether the gateway can be sent something
}

export class Connection {
  state: LinkState = { state: 'connecting' };
  private socket: WebSocket | null = null;
  private wait_s = FIRST_WAIT_S;
  private readonly timer: ReturnType<typeof setInterval>;
  private heard_s = 0;
  private checked_s = 0;
  private problem: { code: string; text: string; again_s?: number } | null = null;
  private readonly path: string;
  private readonly listener: ConnectionListener;
  private readonly now_s: () => number;

  constructor(path: string, listener: ConnectionListener, now_s: () => number) {
    this.now_s = now_s;
    this.path = path;
    this.listener = listener;
    this.open();
    this.timer = setInterval(() => this.check(), 250);
  }

  close(): void {
    clearInterval(this.timer);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
  }

  send(text: string): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(text);
  }

  // Messages after one that could not be taken build on it, so the picture begins anew.
  fail(why: string): void {
    this.problem = { code: 'unreadable', text: `a message could not be read: ${why}` };
    this.drop('');
  }

  retryNow(): void {
    if (this.state.state === 'waiting') this.open();
  }

  private set(state: LinkState): void {
    this.state = state;
    this.listener.changed(state);
  }

  private open(): void {
    this.problem = null;
    this.heard_s = this.now_s();
    this.set({ state: 'connecting' });
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    const socket = new WebSocket(`${scheme}://${location.host}${this.path}`, PROTOCOL);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    socket.onopen = () => {
      if (socket === this.socket) this.listener.ready(true);
    };
    socket.onmessage = (event: MessageEvent<ArrayBuffer | string>) => {
      if (socket === this.socket) this.receive(event.data);
    };
    socket.onclose = (event) => {
      if (socket === this.socket) this.lost(event.reason);
    };
  }

  private receive(data: ArrayBuffer | string): void {
    this.heard_s = this.now_s();
    try {
      if (typeof data !== 'string') {
        const message = decode(data);
        if (this.state.state !== 'open') {
          this.wait_s = FIRST_WAIT_S;
          this.set({ state: 'open' });
        }
        this.listener.binary(message);
        return;
      }
      const message = JSON.parse(data) as JsonMessage;
      // A ticket that is lacking ends no connection, and is no reason for a later end.
      if (message.type === 'problem' && message.code !== 'ticket') this.problem = message;
      this.listener.json(message);
    } catch (error) {
      this.fail(String(error));
    }
  }

  private drop(reason: string): void {
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    this.lost(reason);
  }

  private lost(reason: string): void {
    this.socket = null;
    this.listener.ready(false);
    const final = FINAL.has(this.problem?.code ?? '');
    const wait_s = final ? Infinity : (this.problem?.again_s ?? this.wait_s);
    this.wait_s = Math.min(LONGEST_WAIT_S, 2 * this.wait_s);
    const why = this.problem?.text ?? (reason === '' ? 'the connection to the gateway was lost' : reason);
    this.set({ state: 'waiting', again_at_s: this.now_s() + wait_s, why, code: this.problem?.code ?? 'lost' });
  }

  private check(): void {
    const now_s = this.now_s();
    // A page that was itself held up has not read what came meanwhile.
    if (now_s - this.checked_s > 1) this.heard_s = now_s;
    this.checked_s = now_s;
    if (this.state.state === 'waiting') {
      if (now_s >= this.state.again_at_s) this.open();
    } else if (now_s - this.heard_s > SILENCE_S) {
      this.drop('nothing came from the gateway for some seconds');
    }
  }
}

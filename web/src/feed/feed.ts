// Feed: the page's side of its worker, which holds the connection to the gateway.

import type { JsonMessage } from '../protocol/messages.ts';
import type { LinkState } from './connection.ts';
import type { Poses, ToPage, ToWorker, Told } from './messages.ts';

export interface FeedListener {
  message(message: Told, poses: Poses | null): void;
  json(message: JsonMessage): void;
  changed(state: LinkState): void;
  posed(poses: Poses): void;
}

export class Feed {
  spent_ms = 0; // on what the worker sent, since somebody last set it to 0
  private readonly worker: Worker;
  private readonly listener: FeedListener;
  private link = 0;
  private opened = false;
  private ready = false;

  constructor(listener: FeedListener) {
    this.listener = listener;
    this.worker = new Worker(new URL('feed.js', import.meta.url), { type: 'module' });
    this.worker.onerror = () => {
      this.opened = this.ready = false;
      this.listener.changed({ state: 'waiting', again_at_s: Infinity, why: 'a part of this page could not be loaded or has failed: reload the page', code: 'no_worker' });
    };
    this.worker.onmessage = (event: MessageEvent<ToPage>) => {
      const begin = performance.now();
      if (this.opened && event.data.link === this.link) this.take(event.data);
      this.spent_ms += performance.now() - begin;
    };
  }

  open(path: string): void {
    this.opened = true;
    this.ready = false;
    this.tell({ do: 'open', link: ++this.link, path, origin_ms: performance.timeOrigin });
    this.listener.changed({ state: 'connecting' });
  }

  close(): void {
    if (this.opened) this.tell({ do: 'close' });
    this.opened = this.ready = false;
  }

  retryNow(): void {
    this.tell({ do: 'retry' });
  }

  // Says whether there is a connection that it can be sent by.
  send(message: object): boolean {
    if (this.ready) this.tell({ do: 'send', text: JSON.stringify(message) });
    return this.ready;
  }

  // A picture begins; the next is likely at that time. These poses are shown no more.
  drawing(next_s: number, done: Poses[]): void {
    if (this.opened) this.tell({ do: 'draw', next_s, done }, done.map(({ shown }) => shown.buffer));
  }

  private tell(message: ToWorker, transfer: Transferable[] = []): void {
    this.worker.postMessage(message, transfer);
  }

  private take(message: ToPage): void {
    try {
      if (message.told === 'message') this.listener.message(message.message, message.poses ?? null);
      else if (message.told === 'json') this.listener.json(message.message);
      else if (message.told === 'poses') this.listener.posed(message.poses);
      else if (message.told === 'ready') this.ready = message.ready;
      else this.listener.changed(message.state);
    } catch (error) {
      this.tell({ do: 'fail', why: String(error) });
    }
  }
}

// RecordedFeed: what a gateway sent to a viewer, kept with its times, and played to a page again without a cluster.
//
//   const feed = await record('http://127.0.0.1:7710/#plaza-1', 20);
//   const server = new RecordedFeed(feed, 'dist');
//   const address = await server.listen();   // serves the page too
//   server.play();                           // goes on from where pause() left it
//
// While it is paused the page is sent nothing but its last status, once a second, so that something else can be measured
// in between and the page does not take the socket for dead.

import { createReadStream, existsSync, readFileSync, writeFileSync } from 'node:fs';
import { type Server, createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { extname, join, normalize } from 'node:path';
import { WebSocket, WebSocketServer } from 'ws';
import { PROTOCOL } from '../src/protocol/messages.ts';

const TYPES: Record<string, string> = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css' };
const ALIVE_MS = 1000;
const HEAD_BYTES = 13; // before a message in the file: ms as f64, whether it is binary as u8, length as u32

export interface FeedMessage {
  at_ms: number; // since the first
  binary: boolean;
  data: Buffer;
}

// All that a viewer is sent within so many seconds.
export function record(address: string, seconds: number): Promise<FeedMessage[]> {
  const { host, hash } = new URL(address);
  const socket = new WebSocket(`ws://${host}/watch/${hash.slice(1)}`, PROTOCOL);
  const feed: FeedMessage[] = [];
  let begin = 0;
  return new Promise((done, fail) => {
    socket.on('message', (data: Buffer, binary: boolean) => {
      const now = performance.now();
      if (feed.length === 0) begin = now;
      feed.push({ at_ms: now - begin, binary, data });
      if (now - begin > 1000 * seconds) socket.close();
    });
    socket.on('error', fail);
    socket.on('close', (code, reason) => {
      const long = feed.length > 0 && feed[feed.length - 1]!.at_ms > 1000 * seconds;
      if (long) done(feed);
      else fail(new Error(`the gateway closed its viewer: ${code} ${String(reason)}`));
    });
  });
}

export function write(file: string, feed: FeedMessage[]): void {
  const parts = feed.flatMap(({ at_ms, binary, data }) => {
    const head = Buffer.alloc(HEAD_BYTES);
    head.writeDoubleLE(at_ms, 0);
    head.writeUInt8(binary ? 1 : 0, 8);
    head.writeUInt32LE(data.length, 9);
    return [head, data];
  });
  writeFileSync(file, Buffer.concat(parts));
}

export function read(file: string): FeedMessage[] {
  const bytes = readFileSync(file);
  const feed: FeedMessage[] = [];
  for (let at = 0; at < bytes.length; ) {
    const length = bytes.readUInt32LE(at + 9);
    feed.push({ at_ms: bytes.readDoubleLE(at), binary: bytes.readUInt8(at + 8) === 1, data: bytes.subarray(at + HEAD_BYTES, at + HEAD_BYTES + length) });
    at += HEAD_BYTES + length;
  }
  return feed;
}

export class RecordedFeed {
  private readonly server: Server;
  private readonly sockets = new WebSocketServer({ noServer: true, handleProtocols: () => PROTOCOL });
  private viewer: WebSocket | null = null;
  private next = 0;
  private status: Buffer | null = null;
  private played_ms = 0; // the part of the feed up to the last pause
  private since_ms: number | null = null; // null: paused
  private timer: NodeJS.Timeout | null = null;
  private readonly feed: FeedMessage[];

  constructor(feed: FeedMessage[], page: string) {
    this.feed = feed;
    this.server = createServer((request, response) => {
      const path = new URL(request.url ?? '/', 'http://x').pathname;
      const file = join(page, normalize(path === '/' ? '/index.html' : path));
      if (!existsSync(file)) {
        response.writeHead(404);
        response.end();
        return;
      }
      response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream' });
      createReadStream(file).pipe(response);
    });
    this.server.on('upgrade', (request, socket, head) => {
      this.sockets.handleUpgrade(request, socket, head, (viewer) => (this.viewer = viewer));
    });
  }

  // Whether all of it has been sent.
  get over(): boolean {
    return this.next === this.feed.length;
  }

  async listen(): Promise<string> {
    await new Promise<void>((done) => this.server.listen(0, '127.0.0.1', done));
    return `http://127.0.0.1:${(this.server.address() as AddressInfo).port}`;
  }

  play(): void {
    if (this.timer) clearInterval(this.timer);
    this.since_ms = performance.now();
    this.timer = setInterval(() => this.send(), 2);
  }

  pause(): void {
    if (this.timer) clearInterval(this.timer);
    this.timer = setInterval(() => this.status && this.viewer?.send(this.status, { binary: false }), ALIVE_MS);
    if (this.since_ms !== null) this.played_ms += performance.now() - this.since_ms;
    this.since_ms = null;
  }

  async close(): Promise<void> {
    if (this.timer) clearInterval(this.timer);
    for (const client of this.sockets.clients) client.terminate();
    this.server.closeAllConnections();
    await new Promise((done) => this.server.close(done));
  }

  private send(): void {
    if (!this.viewer || this.since_ms === null) return;
    const now_ms = this.played_ms + performance.now() - this.since_ms;
    while (this.next < this.feed.length && this.feed[this.next]!.at_ms <= now_ms) {
      const { data, binary } = this.feed[this.next++]!;
      this.viewer.send(data, { binary });
      if (!binary && data.includes('"type":"status"')) this.status = data;
    }
  }
}

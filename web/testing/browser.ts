// A headless Chromium with software GL, for tests and measurements.

import { type Browser, type Page, chromium } from 'playwright-core';

export const SIZE = { width: 1280, height: 720 };
export const SMALL = { width: 900, height: 560 }; // software GL pays for every pixel
export const WAIT = { timeout: 20000 * Number(process.env['TESSERA_SLOWNESS'] ?? '1') };

export function launch(): Promise<Browser> {
  const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--hide-scrollbars', '--disable-background-timer-throttling', '--disable-renderer-backgrounding', '--disable-backgrounding-occluded-windows'];
  return chromium.launch({ executablePath: process.env['CHROMIUM'] ?? '/usr/bin/chromium', headless: true, args });
}

// A page shows a message for some seconds, which a slow machine may spend otherwise: each is kept in `messages`.
const KEEP_MESSAGES = `
  window.messages = [];
  new MutationObserver((changes) => {
    for (const node of changes.flatMap((change) => [...change.addedNodes])) {
      if (node.parentElement?.id === 'toasts') messages.push({ kind: node.className, text: node.textContent });
    }
  }).observe(document, { subtree: true, childList: true });`;

// The messages of this kind that the page has shown so far, in their order.
export async function messagesOf(page: Page, kind: 'ok' | 'bad'): Promise<string[]> {
  const all = (await page.evaluate('messages')) as { kind: string; text: string }[];
  return all.filter((message) => message.kind === kind).map((message) => message.text);
}

// Until the page has shown a message of this kind, now or before.
export async function shows(page: Page, kind: 'ok' | 'bad', text: RegExp): Promise<void> {
  await page.waitForFunction(({ kind, source }) => (window as unknown as { messages: { kind: string; text: string }[] }).messages.some((message) => message.kind === kind && new RegExp(source).test(message.text)), { kind, source: text.source }, WAIT);
}

// Things that a page must not do: say something is wrong, or ask another host for something.
export interface Complaints {
  errors: string[];
  foreign: string[];
}

export async function open(browser: Browser, address: string, options: { dark?: boolean; size?: typeof SIZE; before?: (page: Page) => Promise<void> } = {}): Promise<{ page: Page; complaints: Complaints }> {
  const context = await browser.newContext({ viewport: options.size ?? SIZE, colorScheme: options.dark === false ? 'light' : 'dark' });
  const page = await context.newPage();
  const complaints: Complaints = { errors: [], foreign: [] };
  const host = new URL(address).host;
  page.on('console', (message) => {
    if (message.type() === 'error') complaints.errors.push(message.text());
  });
  page.on('pageerror', (error) => complaints.errors.push(String(error)));
  page.on('request', (request) => {
    const url = new URL(request.url());
    if (url.protocol.startsWith('http') && url.host !== host) complaints.foreign.push(request.url());
  });
  await page.addInitScript(KEEP_MESSAGES);
  await options.before?.(page);
  await page.goto(address);
  return { page, complaints };
}

// Until it is true on the page, asked at each picture. A real gateway forbids its page to evaluate texts, as playwright's
// waitForFunction has it do.
export async function holds(page: Page, expression: string, patience_ms: number): Promise<void> {
  const end = performance.now() + patience_ms;
  while (!(await page.evaluate(`window.tessera && (${expression})`))) {
    if (performance.now() > end) throw new Error(`never: ${expression}; ${JSON.stringify(await page.evaluate('window.tessera?.counts'))}`);
    await page.evaluate('new Promise(requestAnimationFrame).then(() => 0)');
  }
}

// Until the page of a fake gateway shows that many bodies, and all four regions.
export async function settled(page: Page, bodies: number): Promise<void> {
  await page.waitForFunction(`window.tessera && tessera.counts.drawn >= ${bodies} && tessera.counts.regions === 4`, undefined, WAIT);
}

// Red, green and blue where a point of the world is, in a picture that is drawn now.
const PIXEL = `(x, y, z) => {
  const { page, view } = tessera;
  page.picture();
  const canvas = document.getElementById('world');
  const gl = canvas.getContext('webgl2');
  const place = view.project(x, y, z);
  const out = new Uint8Array(4);
  gl.readPixels(place.x / canvas.clientWidth * canvas.width, canvas.height - place.y / canvas.clientHeight * canvas.height, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, out);
  return [...out].slice(0, 3);
}`;

export function pixelAt(page: Page, place: readonly number[]): Promise<[number, number, number]> {
  return page.evaluate(`(${PIXEL})(${place.join()})`) as Promise<[number, number, number]>;
}

// The same of a body, seen from above where it is now: `x` and `z` from its middle.
export function bodyPixel(page: Page, id: string, x = 0, z = 0): Promise<[number, number, number]> {
  return page.evaluate(`(() => {
    const { session: { bodies }, view } = tessera;
    const at = 8 * bodies.find('${id}');
    const place = [bodies.shown[at] + ${x}, bodies.shown[at + 1], bodies.shown[at + 2] + ${z}];
    view.follows = false;
    view.rig.set([place[0], place[1] + 12, place[2] + 0.01], place);
    return (${PIXEL})(...place);
  })()`) as Promise<[number, number, number]>;
}

// Watches a page in a headless Chromium for bodies of dead regions that move again, for the suite people.
//
//   node build/measure/gap_page.mjs http://127.0.0.1:7710/#plaza-1 READY
//
// It writes its address into the file READY once the page draws bodies, and answers there:
//
//   /begin?regions=1,2   these regions are killed from now on; answered once a picture has shown whose bodies they are
//   /moved               {"watched": 150, "moved": {"7": 1700000000000.5}, "pictures": 900, "longest": {"wait_ms": 40,
//                        "script_ms": 3}, "complaints": []}
//
// A body has moved again in the first picture that draws it as another region's and elsewhere than the picture before.
// The time is that of the picture's end, in ms since 1970. `longest`: from one picture's end to the next one's, since
// /begin, and what the page's own script took for one of them.

import { renameSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import { holds, launch, open } from './browser.ts';

const SIZE = { width: 640, height: 360 }; // software GL pays for every pixel
const PATIENCE_MS = 60000;

// Runs in the page, after each of its pictures. Places are in the steps of the protocol.
const WATCH = `(() => {
  const { page, session } = tessera;
  const draw = page.picture.bind(page);
  const watch = (window.gap = { regions: new Set(), watched: new Map(), pictures: 0, longest: { wait_ms: 0, script_ms: 0 } });
  let before = performance.now();
  page.picture = () => {
    const begin = performance.now();
    draw();
    const end = performance.now();
    const now = performance.timeOrigin + end;
    const { bodies } = session;
    ++watch.pictures;
    watch.longest.wait_ms = Math.max(watch.longest.wait_ms, end - before);
    watch.longest.script_ms = Math.max(watch.longest.script_ms, end - begin);
    before = end;
    for (let place = 0; place < bodies.count; ++place) {
      const slot = bodies.order[place];
      const at = [0, 1, 2].map((axis) => Math.round(1024 * bodies.shown[8 * slot + axis])).join();
      const id = bodies.id(slot);
      if (watch.regions.has(bodies.owner[slot])) {
        watch.watched.set(id, { at, moved: 0 });
        continue;
      }
      const known = watch.watched.get(id);
      if (!known || known.moved > 0) continue;
      if (known.at !== at) known.moved = now;
      known.at = at;
    }
  };
})()`;

const [address, ready] = process.argv.slice(2) as [string, string];
const browser = await launch();
const { page, complaints } = await open(browser, address, { size: SIZE });
await holds(page, 'tessera.counts.drawn > 0', PATIENCE_MS);
await page.evaluate(WATCH);

async function answer(path: URL): Promise<object> {
  if (path.pathname === '/begin') {
    const regions = (path.searchParams.get('regions') ?? '').split(',').map(Number);
    await page.evaluate(`(gap.regions = new Set(${JSON.stringify(regions)}), gap.watched.clear(), gap.longest = { wait_ms: 0, script_ms: 0 }, gap.from = gap.pictures)`);
    await holds(page, 'gap.pictures > gap.from + 1', PATIENCE_MS);
    return {};
  }
  const seen = (await page.evaluate('({ pictures: gap.pictures, longest: gap.longest, watched: gap.watched.size, moved: Object.fromEntries([...gap.watched].filter(([, { moved }]) => moved > 0).map(([id, { moved }]) => [id, moved])) })')) as object;
  return { ...seen, complaints: [...complaints.errors, ...complaints.foreign] };
}

const server = createServer((request, response) => {
  answer(new URL(request.url ?? '/', 'http://x')).then(
    (said) => response.end(JSON.stringify(said)),
    (error: unknown) => {
      response.writeHead(500);
      response.end(String(error));
    },
  );
});
server.listen(0, '127.0.0.1', () => {
  writeFileSync(`${ready}.new`, `127.0.0.1:${(server.address() as AddressInfo).port}`);
  renameSync(`${ready}.new`, ready);
});
process.on('SIGTERM', () => void browser.close().finally(() => process.exit(0)));

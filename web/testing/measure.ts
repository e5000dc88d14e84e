// Measures the page against a bare page that draws the same 5000 bodies with one InstancedMesh and no more: frame rate,
// script time a frame against copying 5000 matrices, size, requests, complaints. Frames are not capped; the two pages take
// turns, so that a busy machine slows both. With --load it measures instead what a browser loads of a real gateway, and
// how soon the page draws bodies.
//
//   node build/tests/measure.mjs [--rounds 5] [--seconds 4] [--json]
//   node build/tests/measure.mjs --load http://127.0.0.1:7710/#plaza-1
//
// Figures are told by metric: as lines, or as JSON with their spread over the rounds.

import { build } from 'esbuild';
import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import type { Page } from 'playwright-core';
import { launch, open } from './browser.ts';
import { FakeGateway } from './fake_gateway.ts';

const BODIES = 5000;
const option = (name: string, otherwise: number) => {
  const at = process.argv.indexOf(name);
  return at < 0 ? otherwise : Number(process.argv[at + 1]);
};
const rounds = option('--rounds', 5);
const seconds = option('--seconds', 4);

const BARE = `
import * as THREE from 'three';
const canvas = document.querySelector('canvas');
const renderer = new THREE.WebGLRenderer({ canvas, antialias: false });
renderer.setSize(innerWidth, innerHeight, false);
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera(50, innerWidth / innerHeight, 1, 2000);
camera.position.set(45, 93, 120);
camera.lookAt(0, 0, 0);
scene.add(new THREE.HemisphereLight('#fff', '#888', 1.5), new THREE.DirectionalLight('#fff', 2));
const mesh = new THREE.InstancedMesh(new THREE.BoxGeometry(1, 1, 1), new THREE.MeshLambertMaterial(), ${BODIES});
mesh.frustumCulled = false;
scene.add(mesh);
const matrices = Array.from({ length: ${BODIES} }, () => new THREE.Matrix4().makeTranslation(120 * Math.random() - 60, 1, 120 * Math.random() - 60));
window.bare = { copy_ms: [], picture() {
  const begin = performance.now();
  for (let index = 0; index < ${BODIES}; ++index) mesh.setMatrixAt(index, matrices[index]);
  mesh.instanceMatrix.needsUpdate = true;
  bare.copy_ms.push(performance.now() - begin);
  renderer.render(scene, camera);
} };`;


async function barePage(): Promise<{ address: string; close: () => void }> {
  const bundle = await build({ stdin: { contents: BARE, resolveDir: process.cwd() }, bundle: true, minify: true, format: 'esm', write: false });
  const html = '<body style="margin:0"><canvas style="width:100vw;height:100vh;display:block"></canvas><script type="module" src="/b.js"></script>';
  const server = createServer((request, response) => {
    const script = request.url === '/b.js';
    response.writeHead(200, { 'content-type': script ? 'text/javascript' : 'text/html' });
    response.end(script ? bundle.outputFiles[0]!.text : html);
  });
  await new Promise<void>((done) => server.listen(0, '127.0.0.1', done));
  return { address: `http://127.0.0.1:${(server.address() as AddressInfo).port}`, close: () => server.close() };
}

const percentile = (values: number[], share: number) => [...values].sort((a, b) => a - b)[Math.floor(share * (values.length - 1))] ?? NaN;

// Pictures a second without a cap: the next begins when the last is drawn, which reading a pixel waits for. Messages are
// taken in between, as between two pictures of a screen.
function drawn(page: Page, what: string): Promise<number> {
  return page.evaluate(`(async () => {
    const gl = document.querySelector('canvas').getContext('webgl2');
    const pixel = new Uint8Array(4);
    const begin = performance.now();
    let frames = 0;
    while (performance.now() - begin < ${1000 * seconds}) {
      ${what}.picture();
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
      ++frames;
      await new Promise((done) => setTimeout(done, 0));
    }
    return 1000 * frames / (performance.now() - begin);
  })()`) as Promise<number>;
}

interface Figure {
  value: number;
  unit: string;
  p10?: number;
  p90?: number;
}

const p95 = (values: number[]) => percentile(values, 0.95);
const spread = (values: number[], unit = '1'): Figure => ({ value: percentile(values, 0.5), unit, p10: percentile(values, 0.1), p90: percentile(values, 0.9) });

// Counts bytes on the wire until the page draws bodies: headers and compressed bodies of all answers, but no sockets.
async function load(address: string): Promise<Record<string, Figure>> {
  const browser = await launch();
  let bytes = 0;
  let begin = 0;
  const { page, complaints } = await open(browser, address, {
    before: async (page) => {
      const session = await page.context().newCDPSession(page);
      session.on('Network.loadingFinished', (event) => (bytes += event.encodedDataLength));
      await session.send('Network.enable');
      begin = performance.now();
    },
  });
  await page.waitForFunction('window.tessera && tessera.counts.drawn > 0', undefined, { timeout: 60000 });
  const ready_ms = performance.now() - begin;
  await browser.close();
  return {
    page_kbytes: { value: bytes / 1000, unit: 'kB' },
    page_drawn_ms: { value: ready_ms, unit: 'ms' },
    page_requests_elsewhere: { value: complaints.foreign.length, unit: '1' },
    page_console_errors: { value: complaints.errors.length, unit: '1' },
  };
}

async function compare(): Promise<Record<string, Figure>> {
  const gateway = new FakeGateway({ page: 'dist', bodies: BODIES - 420, frame_ms: 100 });
  const browser = await launch();
  const bare = await barePage();
  const address = await gateway.listen();
  const plain = await open(browser, bare.address);
  const inspector = await open(browser, `${address}/#plaza-1`);
  await inspector.page.waitForFunction(`window.tessera && tessera.counts.drawn === ${BODIES}`, undefined, { timeout: 60000 });
  // The same number of pixels for the world, and both pages alike uncapped.
  await inspector.page.evaluate('document.body.classList.add("wide")');
  await inspector.page.evaluate('tessera.page.hold = true');

  const bare_rates: number[] = [];
  const page_rates: number[] = [];
  const own: number[][] = [];
  const copies: number[][] = [];
  for (let round = 0; round < rounds; ++round) {
    await plain.page.evaluate('bare.copy_ms.length = 0');
    bare_rates.push(await drawn(plain.page, 'bare'));
    copies.push((await plain.page.evaluate('bare.copy_ms')) as number[]);
    await inspector.page.evaluate('tessera.perf.reset()');
    page_rates.push(await drawn(inspector.page, 'tessera.page'));
    own.push((await inspector.page.evaluate('tessera.perf.own_ms')) as number[]);
  }
  await browser.close();
  bare.close();
  await gateway.close();
  return {
    frame_rate_ratio: spread(page_rates.map((rate, round) => rate / bare_rates[round]!)),
    page_frames_per_s: spread(page_rates),
    bare_page_frames_per_s: spread(bare_rates),
    // All frames together; the spread is that of the rounds.
    script_time_ratio: { ...spread(own.map((ms, round) => p95(ms) / p95(copies[round]!))), value: p95(own.flat()) / p95(copies.flat()) },
    page_script_p95_ms: { ...spread(own.map(p95), 'ms'), value: p95(own.flat()) },
    copying_p95_ms: { ...spread(copies.map(p95), 'ms'), value: p95(copies.flat()) },
    page_comparison_errors: { value: inspector.complaints.errors.length + inspector.complaints.foreign.length, unit: '1' },
  };
}

const at = process.argv.indexOf('--load');
const figures = at < 0 ? await compare() : await load(process.argv[at + 1]!);
if (at >= 0 || process.argv.includes('--json')) console.log(JSON.stringify(figures));
else for (const [metric, { value, unit, p10, p90 }] of Object.entries(figures)) console.log(`${metric} ${value.toFixed(2)}${unit === '1' ? '' : ` ${unit}`}${p10 === undefined ? '' : ` (p10 ${p10.toFixed(2)}, p90 ${p90!.toFixed(2)})`}`);

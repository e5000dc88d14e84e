// Measures the page, as a recorded feed of 5000 bodies moves it, against a bare page that draws the same bodies with one
// InstancedMesh and no more: from the same camera, on as many pixels. It draws boxes, and in turns with them the geometry
// that the page draws each body with. Frame rate, script time a frame against copying 5000 matrices, size, requests,
// complaints. Script time is told twice: by the clock, which also counts what other threads of the browser take from the
// page's where processors are few, and as that thread's own time of a processor. Frames are not capped; the two pages take
// turns, so that a busy machine slows both, and the feed waits while the bare page has its turn. The machine room is
// hidden: its table is written and its charts are not. The feed is that of a
// gateway, kept by --record, or else the fake gateway's. With --load it measures instead what a browser loads of a real
// gateway, and how soon the page draws.
//
//   node build/tests/measure.mjs [--feed FILE] [--rounds 5] [--seconds 4] [--json]
//   node build/tests/measure.mjs --record http://127.0.0.1:7710/#plaza-1 --feed FILE [--rounds 5] [--seconds 4]
//   node build/tests/measure.mjs --load http://127.0.0.1:7710/#plaza-1
//
// Figures are told by metric: as lines, or as JSON with their spread over the rounds.

import { build } from 'esbuild';
import { createServer } from 'node:http';
import type { AddressInfo } from 'node:net';
import type { CDPSession, Page } from 'playwright-core';
import { holds, launch, open } from './browser.ts';
import { FakeGateway } from './fake_gateway.ts';
import { type FeedMessage, RecordedFeed, read, record, write } from './recorded_feed.ts';

const BODIES = 5000;
const PATIENCE_MS = 60000;
const LOADING_S = 15; // the part of a feed until the page has drawn all
const text = (name: string) => {
  const at = process.argv.indexOf(name);
  return at < 0 ? '' : process.argv[at + 1]!;
};
const rounds = Number(text('--rounds') || 5);
const seconds = Number(text('--seconds') || 4);
const feed_s = LOADING_S + 1.25 * rounds * seconds;

const BARE = `
import * as THREE from 'three';
const canvas = document.querySelector('canvas');
const renderer = new THREE.WebGLRenderer({ canvas, antialias: false });
const scene = new THREE.Scene();
const camera = new THREE.PerspectiveCamera();
scene.add(new THREE.HemisphereLight('#fff', '#888', 1.5), new THREE.DirectionalLight('#fff', 2));
let sets;
window.bare = {
  copy_ms: [],
  same: false,
  begin({ poses, shapes, eye, target, fov, near, far, width, height }) {
    renderer.setSize(width, height, false);
    Object.assign(camera, { fov, near, far, aspect: width / height });
    camera.position.fromArray(eye);
    camera.lookAt(...target);
    camera.updateProjectionMatrix();
    const one = new THREE.Vector3(1, 1, 1);
    const drawn = (geometry, poses) => {
      const matrices = poses.map((pose) => new THREE.Matrix4().compose(new THREE.Vector3(...pose.slice(0, 3)), new THREE.Quaternion(...pose.slice(3)), one));
      const mesh = new THREE.InstancedMesh(geometry, new THREE.MeshLambertMaterial(), matrices.length);
      mesh.frustumCulled = false;
      scene.add(mesh);
      return { mesh, matrices };
    };
    const geometryOf = ({ positions, normals, index }) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
      geometry.setAttribute('normal', new THREE.Float32BufferAttribute(normals, 3));
      return geometry.setIndex(index);
    };
    sets = [[drawn(new THREE.BoxGeometry(1, 1, 1), poses)], shapes.map((shape) => drawn(geometryOf(shape), shape.poses))];
  },
  picture() {
    const begin = performance.now();
    performance.mark('script begins');
    sets.forEach((set, same) => set.forEach(({ mesh }) => (mesh.visible = bare.same === (same === 1))));
    for (const { mesh, matrices } of sets[bare.same ? 1 : 0]) {
      for (let index = 0; index < matrices.length; ++index) mesh.setMatrixAt(index, matrices[index]);
      mesh.instanceMatrix.needsUpdate = true;
    }
    performance.mark('script drew');
    if (!bare.same) bare.copy_ms.push(performance.now() - begin);
    renderer.render(scene, camera);
  },
};`;

// Marks where the page's own script begins and ends: for a picture, and for what its worker sends it.
const MARKED = `(() => {
  const { page, view, session: { feed: { worker } } } = tessera;
  const mark = (owner, name, before, after) => {
    const called = owner[name].bind(owner);
    owner[name] = (...given) => {
      if (before) performance.mark(before);
      called(...given);
      if (after) performance.mark(after);
    };
  };
  mark(page, 'picture', 'script begins');
  mark(view, 'render', 'script drew');
  mark(worker, 'onmessage', 'script begins', 'script ends');
})()`;

// The picture that the page draws now: where its bodies are, what they are drawn with, its camera, and how many pixels it
// draws on.
const SCENE = `(() => {
  const { session: { bodies }, view } = tessera;
  const canvas = document.getElementById('world');
  const { fov, near, far, position } = view.rig.camera;
  const poseOf = (slot) => [0, 1, 2, 4, 5, 6, 7].map((part) => bodies.shown[8 * slot + part]);
  const poses = [...bodies.order.slice(0, bodies.count)].map(poseOf);
  const shapes = [...view.batches.packs()].filter((pack) => pack.count > 0).map((pack) => {
    const { attributes, index } = pack.mesh.geometry;
    const one = (array) => [...array.slice(0, array.length / pack.copies)];
    return { positions: one(attributes.position.array), normals: one(attributes.normal.array), index: one(index.array), poses: [...pack.slots.slice(0, pack.count)].map(poseOf) };
  });
  return { poses, shapes, eye: position.toArray(), target: view.rig.target, fov, near, far, width: canvas.width, height: canvas.height };
})()`;


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

interface Mark {
  name: string;
  pid: number;
  ts: number;
  tts: number; // time of a processor that its thread has had, in us
}

// Milliseconds of a processor that the script between the marks had of each picture, while `work` went on.
async function scriptCpu(session: CDPSession, work: () => Promise<number>): Promise<{ rate: number; cpu_ms: number[] }> {
  const marks: Mark[] = [];
  const collect = ({ value }: { value: unknown[] }) => marks.push(...(value as Mark[]).filter(({ name }) => name.startsWith('script ')));
  session.on('Tracing.dataCollected', collect);
  await session.send('Tracing.start', { traceConfig: { includedCategories: ['blink.user_timing'] }, transferMode: 'ReportEvents' });
  const rate = await work();
  const told = new Promise((done) => session.once('Tracing.tracingComplete', done));
  await session.send('Tracing.end');
  await told;
  session.off('Tracing.dataCollected', collect);
  const cpu_ms: number[] = [];
  let begin: Mark | null = null;
  let spent_ms = 0;
  const drawing = marks.find(({ name }) => name === 'script drew')?.pid; // the other page is also sent something
  for (const mark of marks.filter(({ pid }) => pid === drawing).sort((a, b) => a.ts - b.ts)) {
    if (mark.name === 'script begins') {
      begin = mark;
    } else if (begin) {
      spent_ms += (mark.tts - begin.tts) / 1000;
      begin = null;
      if (mark.name === 'script ends') continue;
      cpu_ms.push(spent_ms);
      spent_ms = 0;
    }
  }
  return { rate, cpu_ms };
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
  await holds(page, 'tessera.counts.drawn > 0', PATIENCE_MS);
  const ready_ms = performance.now() - begin;
  await browser.close();
  return {
    page_kbytes: { value: bytes / 1000, unit: 'kB' },
    page_drawn_ms: { value: ready_ms, unit: 'ms' },
    page_requests_elsewhere: { value: complaints.foreign.length, unit: '1' },
    page_console_errors: { value: complaints.errors.length, unit: '1' },
  };
}

async function fakeFeed(): Promise<FeedMessage[]> {
  const gateway = new FakeGateway({ page: 'dist', bodies: BODIES - 420 });
  const feed = await record(`${await gateway.listen()}/#plaza-1`, feed_s);
  await gateway.close();
  return feed;
}

async function compare(feed: FeedMessage[]): Promise<Record<string, Figure>> {
  const gateway = new RecordedFeed(feed, 'dist');
  const browser = await launch();
  const bare = await barePage();
  const address = await gateway.listen();
  const plain = await open(browser, bare.address);
  gateway.play();
  const inspector = await open(browser, `${address}/#recorded`);
  await holds(inspector.page, `tessera.counts.drawn >= ${BODIES}`, PATIENCE_MS);
  await inspector.page.evaluate('document.body.classList.add("wide")');
  await inspector.page.evaluate('new Promise(requestAnimationFrame)');
  // Both pages alike uncapped.
  await inspector.page.evaluate('tessera.page.hold = true');
  const scene = (await inspector.page.evaluate(SCENE)) as { poses: number[][] };
  await plain.page.evaluate(`bare.begin(${JSON.stringify(scene)})`);
  await inspector.page.evaluate(MARKED);
  const session = await browser.newBrowserCDPSession();

  const bare_rates: number[] = [];
  const same_rates: number[] = [];
  const page_rates: number[] = [];
  const own: number[][] = [];
  const copies: number[][] = [];
  const own_cpu: number[][] = [];
  const copies_cpu: number[][] = [];
  for (let round = 0; round < rounds; ++round) {
    gateway.pause();
    await plain.page.evaluate('bare.copy_ms.length = 0');
    const copied = await scriptCpu(session, () => drawn(plain.page, 'bare'));
    bare_rates.push(copied.rate);
    copies_cpu.push(copied.cpu_ms);
    copies.push((await plain.page.evaluate('bare.copy_ms')) as number[]);
    await plain.page.evaluate('bare.same = true');
    same_rates.push(await drawn(plain.page, 'bare'));
    await plain.page.evaluate('bare.same = false');
    await inspector.page.evaluate('tessera.perf.reset()');
    gateway.play();
    const shown = await scriptCpu(session, () => drawn(inspector.page, 'tessera.page'));
    page_rates.push(shown.rate);
    own_cpu.push(shown.cpu_ms);
    own.push((await inspector.page.evaluate('tessera.perf.own_ms')) as number[]);
    if (gateway.over) throw new Error('the feed was shorter than the measurement: record a longer one');
  }
  await browser.close();
  bare.close();
  await gateway.close();
  return {
    frame_rate_ratio: spread(page_rates.map((rate, round) => rate / bare_rates[round]!)),
    frame_rate_ratio_same_shapes: spread(page_rates.map((rate, round) => rate / same_rates[round]!)),
    page_frames_per_s: spread(page_rates),
    bare_page_frames_per_s: spread(bare_rates),
    bare_page_same_shapes_frames_per_s: spread(same_rates),
    // All frames together; the spread is that of the rounds.
    script_time_ratio: { ...spread(own.map((ms, round) => p95(ms) / p95(copies[round]!))), value: p95(own.flat()) / p95(copies.flat()) },
    page_script_p95_ms: { ...spread(own.map(p95), 'ms'), value: p95(own.flat()) },
    copying_p95_ms: { ...spread(copies.map(p95), 'ms'), value: p95(copies.flat()) },
    script_cpu_ratio: { ...spread(own_cpu.map((ms, round) => p95(ms) / p95(copies_cpu[round]!))), value: p95(own_cpu.flat()) / p95(copies_cpu.flat()) },
    page_script_cpu_p95_ms: { ...spread(own_cpu.map(p95), 'ms'), value: p95(own_cpu.flat()) },
    copying_cpu_p95_ms: { ...spread(copies_cpu.map(p95), 'ms'), value: p95(copies_cpu.flat()) },
    page_comparison_bodies: { value: scene.poses.length, unit: '1' },
    page_comparison_errors: { value: inspector.complaints.errors.length + inspector.complaints.foreign.length, unit: '1' },
  };
}

if (text('--record') !== '') {
  write(text('--feed'), await record(text('--record'), feed_s));
  process.exit(0);
}
const loaded = text('--load');
const figures = loaded !== '' ? await load(loaded) : await compare(text('--feed') !== '' ? read(text('--feed')) : await fakeFeed());
if (loaded !== '' || process.argv.includes('--json')) console.log(JSON.stringify(figures));
else for (const [metric, { value, unit, p10, p90 }] of Object.entries(figures)) console.log(`${metric} ${value.toFixed(2)}${unit === '1' ? '' : ` ${unit}`}${p10 === undefined ? '' : ` (p10 ${p10.toFixed(2)}, p90 ${p90!.toFixed(2)})`}`);

// Builds the page: node build.mjs [--out FOLDER] makes web/dist; node build.mjs --tests FOLDER bundles tests and what they use.

import { build } from 'esbuild';
import { cpSync, mkdirSync, readdirSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
process.chdir(here);
const option = (name) => {
  const at = process.argv.indexOf(name);
  return at < 0 ? undefined : process.argv[at + 1];
};

async function buildPage(folder) {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(join(folder, 'assets'), { recursive: true });
  await build({
    entryPoints: { page: 'src/main.ts', feed: 'src/feed/worker.ts' },
    outdir: join(folder, 'assets'),
    bundle: true,
    minify: true,
    format: 'esm',
    target: 'es2022',
    legalComments: 'none',
    banner: { js: '/* Tessera; with three.js and uPlot, both under the MIT licence: web/LICENSES */' },
    logLevel: 'warning',
  });
  cpSync('src/index.html', join(folder, 'index.html'));
}

async function buildTests(folder) {
  rmSync(folder, { recursive: true, force: true });
  const sources = (from) => readdirSync(from).filter((name) => name.endsWith('.ts')).map((name) => join(from, name));
  const common = {
    bundle: true,
    platform: 'node',
    format: 'esm',
    target: 'node18',
    outExtension: { '.js': '.mjs' },
    external: ['playwright-core', 'ws', 'esbuild'],
    logLevel: 'warning',
  };
  await build({ ...common, entryPoints: sources('tests'), outdir: join(folder, 'tests') });
  await build({ ...common, entryPoints: ['testing/fake_gateway.ts', 'testing/gap_page.ts', 'testing/measure.ts', 'testing/shots.ts'], outdir: folder });
}

const tests = option('--tests');
if (tests) await buildTests(tests);
else await buildPage(option('--out') ?? 'dist');

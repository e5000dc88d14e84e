// node run_tests.mjs unit | browser | cluster [FOLDER]: bundles the tests into FOLDER and runs them with node's own
// runner. `unit` checks the types of all sources too; `browser` builds the page anew as well, and compares it with what is committed; `cluster` has the programs in
// TESSERA_BIN run a cluster, whose gateway serves the page that is committed.

import { spawnSync } from 'node:child_process';
import { existsSync, readFileSync, readdirSync, rmSync, symlinkSync } from 'node:fs';
import { dirname, join, relative, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
process.chdir(here);
const [what, folder = 'build'] = process.argv.slice(2);

function run(...command) {
  const { status } = spawnSync(process.execPath, command, { stdio: 'inherit' });
  if (status !== 0) process.exit(status ?? 1);
}

function files(root) {
  return readdirSync(root, { withFileTypes: true }).flatMap((entry) => {
    const path = join(root, entry.name);
    return entry.isDirectory() ? files(path) : [path];
  });
}

function compare(committed, built) {
  const names = (root) => files(root).map((path) => relative(root, path)).sort();
  const same =
    names(committed).join() === names(built).join() &&
    names(built).every((name) => readFileSync(join(committed, name)).equals(readFileSync(join(built, name))));
  if (same) return;
  console.error('web/dist is not what web/src builds: run ./dev page and commit web/dist');
  process.exit(1);
}

if (!existsSync('node_modules')) {
  console.error('web/node_modules is missing: ./dev page installs it');
  process.exit(1);
}
const bundles = join(folder, `bundles-${what}`);
run('build.mjs', '--tests', bundles);
// Packages that the bundles import by name are looked for above them, and FOLDER may lie anywhere.
const packages = join(bundles, 'node_modules');
rmSync(packages, { force: true });
symlinkSync(resolve('node_modules'), packages);
if (what === 'unit') run('node_modules/typescript/bin/tsc', '--noEmit');
const ending = { browser: '.browser.mjs', cluster: '.cluster.mjs' }[what] ?? '.test.mjs';
if (what === 'browser') {
  const built = join(folder, 'dist');
  run('build.mjs', '--out', built);
  compare('dist', built);
}
run('--test', ...files(join(bundles, 'tests')).filter((path) => path.endsWith(ending)));

// LocalCluster: `tessera up` of a build, on loopback and with a folder of its own, for tests that need a real gateway.
//
//   const cluster = await LocalCluster.start('build/dev/bin');
//   await cluster.tessera('instance', 'create', '--scene', 'platforms', '--wait');
//   await cluster.killControl();   // by SIGKILL; nobody starts it again until restartControl()
//   await cluster.stop();

import { type ChildProcess, execFile, spawn } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { createInterface } from 'node:readline';

export class LocalCluster {
  page = ''; // the address that it printed
  control = '';
  readonly folder = mkdtempSync(join(tmpdir(), 'tessera-page-'));
  private readonly children: ChildProcess[] = [];
  private readonly bin: string;

  private constructor(bin: string) {
    this.bin = bin;
  }

  static async start(bin: string, hosts = 1): Promise<LocalCluster> {
    const cluster = new LocalCluster(bin);
    const line = await cluster.firstLine('tessera', '-o', 'json', 'up', '--socket', join(cluster.folder, 'control.sock'), '--state-dir', cluster.folder, '--page-listen', '127.0.0.1:0', '--metrics-listen', '127.0.0.1:0', '--capacity', '8', '--hosts', String(hosts));
    const { page, control } = JSON.parse(line) as { page: string; control: string };
    cluster.page = page;
    cluster.control = control;
    return cluster;
  }

  // The address of a gateway beside the cluster's own, with its key.
  async gateway(): Promise<string> {
    const name = join(this.folder, `gateway-${this.children.length}`);
    const child = this.spawn('tessera-gateway', '--control', this.control, '--listen', '127.0.0.1:0', '--metrics-listen', '127.0.0.1:0', '--key-file', `${name}.key`, '--log-level', 'info');
    const address = await until(child, /ready http=([^ ]+)/);
    return `http://${address}/#key=${readFileSync(`${name}.key`, 'utf8').trim()}`;
  }

  // Ends the gateway that was started last.
  async endGateway(): Promise<void> {
    await end(this.children.pop()!);
  }

  // `tessera up` would start it again at once, so that stands meanwhile.
  async killControl(): Promise<void> {
    const up = this.children[0]!;
    const control = childOf(up.pid!, 'tessera-control');
    up.kill('SIGSTOP');
    process.kill(control, 'SIGKILL');
    while (!hasEnded(control)) await new Promise((done) => setImmediate(done));
  }

  restartControl(): void {
    this.children[0]!.kill('SIGCONT');
  }

  // Returns the command's output. It throws what it complains of.
  tessera(...command: string[]): Promise<string> {
    return new Promise((done, fail) => {
      execFile(join(this.bin, 'tessera'), ['--control', this.control, ...command], (error, out, err) => (error ? fail(new Error(`tessera ${command.join(' ')}: ${err}`)) : done(out)));
    });
  }

  async stop(): Promise<void> {
    if (this.children.length > 0) this.restartControl();
    while (this.children.length > 0) await end(this.children.pop()!);
    rmSync(this.folder, { recursive: true, force: true });
  }

  private spawn(program: string, ...more: string[]): ChildProcess {
    const child = spawn(join(this.bin, program), more, { env: { ...process.env, TESSERA_BIN: this.bin }, stdio: ['ignore', 'pipe', 'pipe'] });
    this.children.push(child);
    return child;
  }

  private firstLine(program: string, ...more: string[]): Promise<string> {
    return until(this.spawn(program, ...more), /^(\{.*\})$/);
  }
}

async function end(child: ChildProcess): Promise<void> {
  if (child.exitCode !== null || child.signalCode !== null) return;
  const ended = new Promise((done) => child.once('exit', done));
  child.kill('SIGTERM');
  await ended;
}

// Name, state and parent of a process, as the kernel has them; null where there is none.
function statOf(pid: number | string): { name: string; state: string; parent: number } | null {
  const file = `/proc/${pid}/stat`;
  if (!existsSync(file)) return null;
  try {
    const [, name, state, parent] = /\((.*)\) (.) ([0-9]+)/.exec(readFileSync(file, 'utf8'))!;
    return { name: name!, state: state!, parent: Number(parent) };
  } catch {
    return null; // it has gone meanwhile
  }
}

function childOf(parent: number, name: string): number {
  const found = readdirSync('/proc').find((pid) => {
    const stat = /^[0-9]+$/.test(pid) ? statOf(pid) : null;
    return stat?.parent === parent && stat.name === name && stat.state !== 'Z';
  });
  if (!found) throw new Error(`process ${parent} has no child ${name}`);
  return Number(found);
}

// Its parent may not have been told yet.
function hasEnded(pid: number): boolean {
  const stat = statOf(pid);
  return stat === null || stat.state === 'Z';
}

// The first group of the pattern in a line that the program writes.
function until(child: ChildProcess, pattern: RegExp): Promise<string> {
  return new Promise((done, fail) => {
    let said = '';
    const take = (line: string) => {
      said += `${line}\n`;
      const found = pattern.exec(line);
      if (found) done(found[1]!);
    };
    createInterface({ input: child.stdout! }).on('line', take);
    createInterface({ input: child.stderr! }).on('line', take);
    child.once('error', fail);
    child.once('exit', (code) => fail(new Error(`${child.spawnfile} ended with ${code}: ${said}`)));
  });
}

// WorldList: what `/` shows: the worlds that run, the recordings there are, and what to do where there is neither.

import type { RecordingEntry, WorldEntry } from '../protocol/messages.ts';
import { bytes, capital, clock, h, setText } from './dom.ts';

const REFRESH_S = 2;

export class WorldList {
  readonly element = h('main', { id: 'worlds', hidden: true });
  private readonly problem = h('p', { class: 'warn', role: 'alert', hidden: true });
  private readonly worlds = h('div', { class: 'cards' });
  private readonly recordings = h('div', { class: 'cards' });
  private readonly note = h('p', { role: 'status' });
  private timer = 0;

  constructor() {
    this.element.append(
      h('h1', {}, 'Worlds'),
      h('p', { class: 'lead' }, 'Choose one to watch. This list follows what the control plane runs.'),
      this.problem,
      this.worlds,
      this.note,
      h('h1', {}, 'Recordings'),
      this.recordings,
    );
  }

  show(): void {
    this.element.hidden = false;
    void this.refresh();
    this.timer = window.setInterval(() => void this.refresh(), 1000 * REFRESH_S);
  }

  hide(): void {
    this.element.hidden = true;
    window.clearInterval(this.timer);
  }

  private async refresh(): Promise<void> {
    try {
      const [worlds, recordings] = await Promise.all([
        get<{ worlds: WorldEntry[]; problem?: string }>('/api/worlds'),
        get<{ recordings: RecordingEntry[] }>('/api/recordings'),
      ]);
      this.drawWorlds(worlds.worlds, worlds.problem ?? '');
      this.drawRecordings(recordings.recordings);
    } catch (error) {
      this.problem.hidden = true;
      this.note.replaceChildren(`The gateway does not answer (${String(error)}). This page asks again every ${REFRESH_S} seconds.`);
    }
  }

  // `problem`: why the list is old, or has not come.
  private drawWorlds(worlds: WorldEntry[], problem: string): void {
    const known = worlds.length > 0 ? 'This list is the last that came' : 'Which worlds there are is not known';
    this.problem.hidden = problem === '';
    if (problem !== '') setText(this.problem, `${capital(problem)} ${known}; those that run go on meanwhile. It is asked for again every ${REFRESH_S} seconds.`);
    const empty = ['No world runs. Start one with ', h('code', {}, 'tessera instance create --scene plaza --regions 4'), ', or try ', h('code', {}, './dev demo'), '.'];
    this.note.replaceChildren(...(worlds.length === 0 && problem === '' ? empty : []));
    replace(
      this.worlds,
      worlds.map((world) =>
        card(`#${world.instance}`, world.instance, [
          world.state.toLowerCase(),
          world.scene,
          `${world.regions} regions`,
          `${world.players} players`,
        ]),
      ),
    );
  }

  private drawRecordings(recordings: RecordingEntry[]): void {
    const cards = recordings.map((recording) =>
      card(`#play/${recording.file}`, recording.file, [
        recording.instance,
        recording.seconds === null ? 'not ended' : clock(recording.seconds),
        bytes(recording.bytes),
      ]),
    );
    const none = h('p', {}, 'None yet. The Record button of a world makes one.');
    replace(this.recordings, cards.length === 0 ? [none] : cards);
  }
}

// Leaves what stands where it would look the same, so that the focus stays where it is.
function replace(box: HTMLElement, children: HTMLElement[]): void {
  const next = children.map((child) => child.outerHTML).join('');
  if (box.innerHTML !== next) box.replaceChildren(...children);
}

function card(href: string, title: string, facts: string[]): HTMLElement {
  return h('a', { href, class: 'card' }, h('strong', {}, title), ...facts.map((fact) => h('span', {}, fact)));
}

async function get<T>(path: string): Promise<T> {
  const response = await fetch(path);
  if (!response.ok) throw new Error(`${path}: ${response.status}`);
  return (await response.json()) as T;
}

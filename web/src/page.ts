// Page: puts the parts together, and draws a picture whenever the screen wants one.

import { type JsonMessage, type PartitionMap, type ShapeVisuals, type TileEntry, type Welcome, Kind, type BinaryMessage } from './protocol/messages.ts';
import type { LinkState } from './feed/connection.ts';
import type { FrameTold } from './feed/messages.ts';
import { takeKey, takeTicket } from './right.ts';
import { Session, type SessionListener } from './session.ts';
import { Board } from './ui/board.ts';
import { DetailPanel } from './ui/detail.ts';
import { capital, h, number, setText } from './ui/dom.ts';
import { Hands } from './ui/hands.ts';
import { Keys } from './ui/keys.ts';
import { Labels } from './ui/labels.ts';
import { MachineRoom } from './ui/machine_room.ts';
import { SecretDialog } from './ui/secret_dialog.ts';
import { TimeBar } from './ui/time_bar.ts';
import { Tools } from './ui/tools.ts';
import { WorldList } from './ui/worlds.ts';
import { Perf } from './ui/perf.ts';
import { POSE_PARTS } from './world/bodies.ts';
import { NoWebGl, WorldView } from './view/world_view.ts';

const STALE_S = 1.5;
const STEER_EVERY_S = 1 / 30;
const SLOW_UI_EVERY_S = 0.25;
const TOAST_S = 6;
const LONGEST_PICTURE_S = 0.25; // the next is not waited for any longer
const LIMITED_S = 1; // so long after a frame that left bodies out, the page says so

export class Page implements SessionListener {
  readonly session: Session = new Session(this);
  readonly view: WorldView;
  readonly perf = new Perf();
  hold = false; // draws only when asked, for measurements
  private readonly canvas = h('canvas', { id: 'world', tabindex: 0, 'aria-label': 'The world. Arrows move, T looks from above, H shows it all.' });
  private readonly order = (order: string, fields?: Record<string, unknown>) => this.session.order(order, fields);
  private readonly room: MachineRoom;
  private readonly detail: DetailPanel;
  private readonly time: TimeBar;
  private readonly tools: Tools;
  private readonly hands = new Hands();
  private readonly labels = new Labels();
  private readonly board = new Board();
  private readonly list = new WorldList();
  private readonly right = new SecretDialog({
    id: 'right',
    title: 'Who gives this order?',
    label: 'Access token',
    note: 'The token is kept until this tab is closed, and sent to this gateway alone.',
    warning: 'This page came without encryption: whoever is on the network between can read the token.',
    use: 'Use token',
  });
  private readonly tickets = new SecretDialog({
    id: 'ticket',
    title: 'Who plays?',
    label: 'Ticket',
    note: 'The game’s own site or backend gives tickets. One is good for a single try, and this page keeps it nowhere.',
    warning: 'This page came without encryption: whoever is on the network between can read the ticket.',
    use: 'Play',
  });
  private readonly name = h('strong', { id: 'name' });
  private readonly state = h('span', { class: 'pill' });
  private readonly fresh = h('span', { class: 'pill', id: 'fresh' });
  private readonly counts = h('span', { id: 'counts' });
  private readonly banner = h('div', { id: 'banner', role: 'alert', hidden: true });
  private readonly toasts = h('div', { id: 'toasts', role: 'status' });
  private marks = true; // contacts are shown
  private ticket = ''; // from the address, until it is shown
  private wanted_name = ''; // the player that this visitor wanted to be last
  private names = new Map<number, string>();
  private steered_s = 0;
  private steered = '';
  private slow_s = 0;
  private last_s = 0;
  private fitted = '';

  constructor(root: HTMLElement) {
    this.room = new MachineRoom(this.order, (region) => this.lookAtRegion(region));
    this.detail = new DetailPanel(this.order, () => this.select(-1), () => this.toggleFollow());
    this.time = new TimeBar(this.order, (message) => this.session.send(message));
    this.tools = new Tools({
      mode: (mode, property) => {
        this.session.colourBy(property);
        this.view.setMode(mode);
      },
      borders: (on) => this.view.setBorders(on),
      contacts: (on) => (this.marks = on),
      shadows: (on) => this.view.setShadows(on),
      home: () => this.home(false),
      above: () => this.home(true),
      find: (text) => this.find(text),
      join: (name) => this.join(name),
    });
    const retry = h('button', { onclick: () => this.session.retryNow() }, 'Try now');
    this.banner.append(h('span'), retry);
    const bar = h(
      'header',
      { id: 'bar' },
      h('a', { href: '#', class: 'logo', title: 'All worlds' }, h('i'), 'Tessera'),
      this.name,
      this.state,
      this.fresh,
      this.counts,
      h('button', { class: 'quiet', title: 'Show or hide the machine room (M)', onclick: () => this.toggleRoom() }, 'Machine room'),
    );
    const stage = h('div', { id: 'stage' }, this.canvas, this.labels.element, this.board.element, this.tools.element, this.detail.element, this.banner, this.toasts);
    root.append(bar, stage, this.room.element, this.time.element, this.list.element, this.right.element, this.tickets.element);
    try {
      this.view = new WorldView(this.canvas, this.session.bodies, this.session.shapes, this.session.values, (text) => this.answered(text, false));
    } catch (error) {
      if (!(error instanceof NoWebGl)) throw error;
      root.replaceChildren(h('main', { id: 'worlds' }, h('h1', {}, 'This browser does not draw in 3D'), h('p', {}, 'The page needs WebGL 2. Turn on hardware acceleration in the settings of the browser, or use a newer Firefox, Chrome or Safari. Without it: tessera instance describe ID shows the figures in a terminal.')));
      throw error;
    }
    this.listen();
    this.tools.begin(!this.view.software);
    new ResizeObserver(() => this.fit()).observe(stage);
    this.fit();
    this.route();
    this.expose();
    requestAnimationFrame(() => this.loop());
  }

  private listen(): void {
    window.addEventListener('hashchange', () => this.route());
    const dark = window.matchMedia('(prefers-color-scheme: dark)');
    const theme = () => {
      this.view.setTheme(dark.matches);
      this.room.charts.setTheme(dark.matches);
    };
    dark.addEventListener('change', theme);
    theme();
    let down = { x: 0, y: 0 };
    this.canvas.addEventListener('pointerdown', (event) => {
      down = { x: event.clientX, y: event.clientY };
      this.canvas.focus();
    });
    this.canvas.addEventListener('click', (event) => {
      if (Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5) this.select(this.view.pickAt(event.clientX, event.clientY));
    });
    new Keys({
      home: () => this.home(false),
      above: () => this.home(true),
      follow: () => this.toggleFollow(),
      pause: () => this.time.togglePause(),
      step: () => this.time.stepBy(1),
      back: () => this.time.stepBy(-1),
      record: () => this.time.toggleRecord(),
      room: () => this.toggleRoom(),
      find: () => this.tools.focusFind(),
      escape: () => this.select(-1),
      colour: () => this.tools.nextMode(),
    });
  }

  // `#plaza-1` is a world, `#play/FILE` a recording, and nothing the list.
  private route(): void {
    takeKey();
    this.ticket = takeTicket() || this.ticket;
    const place = decodeURIComponent(location.hash.slice(1));
    document.body.classList.toggle('listing', place === '');
    this.session.selected = '';
    if (place === '') {
      this.session.close();
      this.banner.hidden = true;
      document.title = 'Tessera';
      this.list.show();
      return;
    }
    this.list.hide();
    const replay = place.startsWith('play/');
    const name = replay ? place.slice(5) : place;
    document.title = `${name} – Tessera`;
    setText(this.name, name);
    this.time.setReplay(replay);
    this.tools.setReplay(replay);
    this.room.setReplay(replay);
    this.fitted = '';
    this.session.open(`/${replay ? 'play' : 'watch'}/${encodeURIComponent(name)}`);
  }

  // --- SessionListener

  began(): void {
    this.view?.clear();
    this.labels.stale = true;
    this.board.clear();
  }

  welcomed(welcome: Welcome): void {
    if (this.fitted !== welcome.instance) this.view.setBounds(welcome.bounds);
    this.fitted = welcome.instance;
    this.tools.setPlaying(welcome.own_player > 0);
    this.tools.setProperties(welcome.properties.map(({ name }) => name));
    this.playByTicket();
  }

  visuals(visuals: ShapeVisuals[]): void {
    this.view.visuals.add(visuals);
  }

  statics(message: BinaryMessage & { kind: Kind.statics }): void {
    this.view.addStatics(message.statics);
  }

  tiled(tiles: TileEntry[]): void {
    this.view.tiles.begin(tiles);
  }

  mapped(map: PartitionMap): void {
    this.view.setMap(map);
    this.tools.setRegions(map.regions.map((region) => region.region));
  }

  framed(frame: FrameTold): void {
    this.view.recolourChanged(frame.states);
    this.findOwn();
    if (this.session.selected !== '' && this.view.selected < 0) this.view.selected = this.session.bodies.find(this.session.selected);
  }

  deadChanged(): void {
    this.view.setDead(this.session.room.dead);
  }

  appeared(slot: number): void {
    this.view.appeared(slot);
    this.labels.stale = true;
  }

  vanished(slot: number): void {
    this.view.vanished(slot);
    this.labels.stale = true;
  }

  ownerChanged(slot: number, from: number): void {
    this.view.ownerChanged(slot, from);
  }

  linked(link: LinkState): void {
    this.banner.hidden = link.state !== 'waiting';
    if (link.state === 'waiting') this.toldWaiting(link);
  }

  said(message: JsonMessage): void {
    if (message.type === 'recording') this.time.showRecording(message);
    if (message.type === 'world') this.board.show(message.properties);
    if (message.type === 'corrected') this.time.showCorrection(message.text);
    if (message.type === 'play') this.time.showPlay(message);
    if (message.type === 'met' && this.marks) this.view.showContact(message);
    // A visitor who may watch and not play is connected again at once, to watch: the reason stays to be read.
    const barred = message.type === 'problem' && message.code === 'not_allowed' && this.session.welcome !== null;
    if (barred || (message.type === 'problem' && message.code === 'bad_message')) this.answered(message.text, false);
    if (message.type === 'problem' && message.code === 'ticket') this.tickets.ask(`${capital(message.text)}.`, (ticket) => this.join(null, ticket));
    if (barred && this.wanted_name !== '') this.lacksToken('Playing here needs an operator’s access token.', () => this.join(this.wanted_name));
    if (message.type === 'status') this.names = new Map((message.player_list ?? []).map((player) => [player.player, player.name]));
  }

  answered(text: string, ok: boolean): void {
    const toast = h('p', { class: ok ? 'ok' : 'bad' }, text);
    this.toasts.append(toast);
    window.setTimeout(() => toast.remove(), 1000 * TOAST_S);
  }

  valued(ids: string[], all: boolean): void {
    this.view.valued(ids, all);
    this.tools.showValues(this.session.values);
  }

  lacksToken(why: string, again: () => void): void {
    this.right.ask(why, (token) => this.session.authorize({ token }, again));
  }

  // --- What a person does

  private join(name: string | null, ticket = ''): void {
    this.wanted_name = name ?? '';
    if (ticket !== '') this.session.send({ type: 'join', ticket });
    else this.session.send(name === null ? { type: 'leave' } : { type: 'join', name });
  }

  // A visitor who came by an address with a ticket came to play. A recording is not played in.
  private playByTicket(): void {
    if (this.ticket === '' || this.session.play !== null || location.hash.startsWith('#play/')) return;
    const ticket = this.ticket;
    this.ticket = '';
    this.join(null, ticket);
  }

  private select(slot: number): void {
    this.view.selected = slot;
    if (slot < 0) this.view.follows = this.view.own >= 0;
    this.session.select(slot < 0 ? '' : this.session.bodies.id(slot));
    this.detail.show(this.session.bodies, slot, null, this.view.follows);
  }

  private find(text: string): boolean {
    const bodies = this.session.bodies;
    const found = bodies.find(text) >= 0 ? bodies.find(text) : bodies.findName(text);
    if (found < 0) return false;
    this.select(found);
    this.view.follows = true;
    return true;
  }

  private toggleFollow(): void {
    this.view.follows = !this.view.follows && (this.view.selected >= 0 || this.view.own >= 0);
  }

  private toggleRoom(): void {
    document.body.classList.toggle('wide');
  }

  private home(above: boolean): void {
    this.view.follows = false;
    this.view.rig.frame(this.session.welcome?.bounds ?? [-50, 0, -50, 50, 20, 50], above);
  }

  private lookAtRegion(region: number): void {
    const cells = this.session.map?.cells.filter((cell) => cell.owner === region) ?? [];
    if (cells.length === 0) return;
    this.view.follows = false;
    const bounds = this.session.welcome!.bounds;
    this.view.rig.frame(
      [
        Math.min(...cells.map((cell) => cell.min_x)),
        bounds[1]!,
        Math.min(...cells.map((cell) => cell.min_z)),
        Math.max(...cells.map((cell) => cell.max_x)),
        bounds[4]!,
        Math.max(...cells.map((cell) => cell.max_z)),
      ],
      false,
    );
  }

  private findOwn(): void {
    const own = this.session.welcome?.own_body ?? '0';
    if (own === '0' || this.view.own >= 0) return;
    const slot = this.session.bodies.find(own);
    if (slot < 0) return;
    this.view.own = slot;
    this.view.follows = true;
    const at = POSE_PARTS * slot;
    const { shown } = this.session.bodies;
    this.view.rig.chase(shown[at]!, shown[at + 1]!, shown[at + 2]!);
  }

  // --- Each picture

  private loop(): void {
    requestAnimationFrame(() => this.loop());
    if (!this.hold) this.picture();
  }

  picture(): void {
    const begin = performance.now();
    const now_s = begin / 1000;
    const since_s = now_s - this.last_s;
    const seconds = Math.min(0.1, since_s);
    this.last_s = now_s;
    if (document.body.classList.contains('listing')) return;
    this.steer(now_s, seconds);
    this.view.update(now_s);
    this.session.drawing(now_s + Math.min(LONGEST_PICTURE_S, since_s));
    this.labels.draw(this.session.bodies, this.view, this.names);
    if (now_s - this.slow_s > SLOW_UI_EVERY_S) {
      this.slow_s = now_s;
      this.drawSlowly(now_s);
    }
    const own_ms = performance.now() - begin;
    this.view.render();
    this.perf.add(begin, own_ms + this.session.feed.spent_ms, performance.now() - begin);
    this.session.feed.spent_ms = 0;
  }

  private steer(now_s: number, seconds: number): void {
    const rig = this.view.rig;
    const [turn, tilt] = this.hands.turn;
    if (turn !== 0 || tilt !== 0) rig.turn(turn, tilt, seconds);
    if (this.view.own < 0) {
      const [right, forward] = this.hands.move;
      if (right !== 0 || forward !== 0) {
        this.view.follows = false;
        rig.pan(right, forward, seconds);
      }
      return;
    }
    if (now_s - this.steered_s < STEER_EVERY_S) return;
    const steering = this.hands.steering(rig.yaw, rig.pitch);
    const text = JSON.stringify(steering);
    if (text === this.steered) return;
    this.steered = text;
    this.steered_s = now_s;
    this.session.send({ type: 'steer', ...steering });
  }

  // Texts that people read need not change more often than they can.
  private drawSlowly(now_s: number): void {
    const { session } = this;
    session.checkOrders(now_s);
    session.lookAt(this.view.rig.target, this.view.rig.distance);
    this.view.tiles.lookAt(this.view.rig.target, this.view.rig.distance);
    this.room.draw(session.room, now_s);
    this.detail.show(session.bodies, this.view.selected, session.detail, this.view.follows);
    if (session.link.state === 'waiting') this.toldWaiting(session.link);
    const status = session.room.status;
    setText(this.state, session.play ? 'recording' : session.paused ? 'paused' : (status?.state ?? '…').toLowerCase());
    this.state.title = status?.reason ?? '';
    const age_s = now_s - session.frame_at_s;
    const figures_s = session.room.age_s(now_s);
    const stale = age_s > STALE_S && !session.paused && !session.play?.paused;
    const late = status !== null && figures_s > 5;
    this.fresh.className = `pill ${stale ? 'bad' : late ? 'warn' : 'good'}`;
    if (session.play) setText(this.fresh, session.play.paused ? 'paused' : `${session.play.speed}×`);
    else setText(this.fresh, !Number.isFinite(age_s) ? 'waiting' : stale ? `stale ${age_s.toFixed(1)} s` : late ? `figures ${figures_s.toFixed(0)} s old` : 'live');
    const limited = now_s - session.limited_at_s < LIMITED_S;
    this.counts.classList.toggle('limited', limited);
    this.counts.title = limited ? 'More moves than the budget of bytes has room for: bodies far away come later (--max-viewer-kbytes).' : '';
    setText(this.counts, `${number(session.bodies.count)} bodies · ${number(session.bodies.moving_count)} moving · ${this.perf.rate.toFixed(0)} fps${limited ? ' · some late' : ''}`);
    this.time.showPaused(session.play ? session.play.paused : session.paused);
    const rate = session.welcome?.tick_rate ?? 60;
    this.time.showTick(session.tick, rate);
    this.time.showPace(status?.ticks_per_second ?? 0, rate, now_s);
  }

  private toldWaiting(link: LinkState & { state: 'waiting' }): void {
    const advice: Record<string, string> = {
      no_world: 'Check the name, or choose one from the list of worlds (Tessera, top left).',
      not_allowed: 'To watch, it is the gateway that needs the right, not this browser.',
      lost: 'What is shown is the last that came.',
      ended: 'What is shown is its last moment. Other worlds are in the list (Tessera, top left).',
      failed: 'An operator may bring it back from a checkpoint: tessera instance restore.',
      full: 'Somebody has to leave before another can play; watching takes no place in it.',
      too_many_viewers: 'This gateway shows worlds to as many as it may: --max-viewers.',
      no_control_plane: 'The gateway asks again by itself; worlds run on meanwhile.',
      no_recording: 'The list of worlds has the recordings that there are (Tessera, top left).',
      damaged: 'The file of the recording cannot be read to its end.',
    };
    const left_s = Math.max(0, link.again_at_s - performance.now() / 1000);
    const next = Number.isFinite(left_s) ? ` Connecting again in ${left_s.toFixed(0)} s.` : '';
    setText(this.banner.firstElementChild!, `${capital(link.why)}. ${advice[link.code] ?? ''}${next}`);
  }

  private fit(): void {
    const stage = this.canvas.parentElement!;
    if (stage.clientWidth > 0) this.view.resize(stage.clientWidth, stage.clientHeight);
  }

  // For tests and for the curious: window.tessera in the console.
  private expose(): void {
    const { session, view, perf } = this;
    const page = this;
    Object.assign(window, {
      tessera: {
        session,
        view,
        perf,
        page,
        get counts() {
          return {
            bodies: session.bodies.count,
            drawn: view.batches.drawn,
            statics: view.level.count,
            visuals: view.visuals.drawn,
            tiles: view.tiles.drawn,
            regions: session.map?.regions.length ?? 0,
            frames: session.frames,
            owner_changes: session.bodies.owner_changes,
            dead: [...session.room.dead],
            contacts: view.contacts.count,
            link: session.link.state,
          };
        },
      },
    });
  }
}

// Hands: keys and gamepad. A player's become what `steer` holds; a watcher's move the camera.

export interface Steering {
  force: number[];
  torque: number[];
  move: number[];
  yaw: number;
  pitch: number;
  buttons: number;
}

const JUMP = 1;
const RUN = 2;
const FORCE_N = 300; // for bodies that are pushed, and the scene limits it; a character takes `move`
const DEAD_ZONE = 0.18;
const KEYS = ['KeyW', 'KeyA', 'KeyS', 'KeyD', 'ArrowUp', 'ArrowDown', 'ArrowLeft', 'ArrowRight', 'Space', 'ShiftLeft', 'ShiftRight'];

export class Hands {
  private readonly down = new Set<string>();

  constructor() {
    window.addEventListener('keydown', (event) => {
      if (typing(event) || event.ctrlKey || event.metaKey || event.altKey || !KEYS.includes(event.code)) return;
      // A button that has the focus keeps its space bar.
      if (event.code === 'Space' && event.target instanceof HTMLButtonElement) return;
      this.down.add(event.code);
      event.preventDefault();
    });
    window.addEventListener('keyup', (event) => this.down.delete(event.code));
    window.addEventListener('blur', () => this.down.clear());
  }

  // Right and forward, -1 to 1 each, and no longer than 1 together.
  get move(): [number, number] {
    const held = (...codes: string[]) => (codes.some((code) => this.down.has(code)) ? 1 : 0);
    let right = held('KeyD', 'ArrowRight') - held('KeyA', 'ArrowLeft');
    let forward = held('KeyW', 'ArrowUp') - held('KeyS', 'ArrowDown');
    const stick = pad()?.axes;
    if (stick && Math.hypot(stick[0] ?? 0, stick[1] ?? 0) > DEAD_ZONE) {
      right += stick[0] ?? 0;
      forward -= stick[1] ?? 0;
    }
    const length = Math.max(1, Math.hypot(right, forward));
    return [right / length, forward / length];
  }

  // How far the right stick turns the camera: to the right and up, -1 to 1 each.
  get turn(): [number, number] {
    const axes = pad()?.axes;
    const beyond = (axis: number) => (Math.abs(axis) > DEAD_ZONE ? axis : 0);
    return [beyond(axes?.[2] ?? 0), -beyond(axes?.[3] ?? 0)];
  }

  steering(yaw: number, pitch: number): Steering {
    const [right, forward] = this.move;
    const buttons = pad()?.buttons;
    const jump = this.down.has('Space') || buttons?.[0]?.pressed === true;
    const run = this.down.has('ShiftLeft') || this.down.has('ShiftRight') || buttons?.[1]?.pressed === true;
    const push = FORCE_N * (run ? 2 : 1);
    return {
      force: [
        (right * Math.cos(yaw) - forward * Math.sin(yaw)) * push,
        jump ? 2 * push : 0,
        (-right * Math.sin(yaw) - forward * Math.cos(yaw)) * push,
      ].map((part) => Math.round(100 * part) / 100),
      torque: [0, 0, 0],
      move: [right, forward],
      yaw,
      pitch,
      buttons: (jump ? JUMP : 0) | (run ? RUN : 0),
    };
  }
}

export function typing(event: Event): boolean {
  const target = event.target;
  return target instanceof HTMLInputElement || target instanceof HTMLSelectElement || target instanceof HTMLTextAreaElement;
}

function pad(): Gamepad | null {
  return navigator.getGamepads?.().find((gamepad) => gamepad?.connected) ?? null;
}

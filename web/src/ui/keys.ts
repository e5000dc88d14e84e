// Keys: single keys that do what buttons do. Those that move are in hands.ts.

import { typing } from './hands.ts';

export interface KeyActions {
  home(): void;
  above(): void;
  follow(): void;
  pause(): void;
  step(): void;
  back(): void;
  record(): void;
  room(): void;
  find(): void;
  escape(): void;
  colour(): void;
}

const ACTIONS: Record<string, keyof KeyActions> = {
  KeyH: 'home',
  KeyT: 'above',
  KeyF: 'follow',
  KeyP: 'pause',
  Period: 'step',
  Comma: 'back',
  KeyR: 'record',
  KeyM: 'room',
  KeyC: 'colour',
  Slash: 'find',
  Escape: 'escape',
};

export class Keys {
  constructor(actions: KeyActions) {
    window.addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
      if (typing(event)) {
        if (event.code === 'Escape') (event.target as HTMLElement).blur();
        return;
      }
      const action = ACTIONS[event.code];
      if (!action) return;
      event.preventDefault();
      actions[action]();
    });
  }
}

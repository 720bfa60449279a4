/// Mouse, touch and keys on the canvas and on the divider.

export interface Moves {
  /// Pixels that the hand moved the object.
  turn(dx: number, dy: number): void;
  /// Factor of the distance.
  zoom(factor: number): void;
  divide(share: number): void;
  dividerShare(): number;
  play(): void;
  reset(): void;
  /// Along the arc, in steps of a twentieth.
  step(count: number): void;
}

const KEY_TURN = 24;

export function listen(canvas: HTMLElement, divider: HTMLElement, moves: Moves): void {
  const pointers = new Map<number, { x: number; y: number }>();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.hypot(a.x - b.x, a.y - b.y);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  });
  canvas.addEventListener("pointermove", (event) => {
    const known = pointers.get(event.pointerId);
    if (!known) return;
    const before = pointers.size === 2 ? spread() : 0;
    const dx = event.clientX - known.x;
    const dy = event.clientY - known.y;
    known.x = event.clientX;
    known.y = event.clientY;
    if (pointers.size === 1) moves.turn(dx, dy);
    if (pointers.size === 2 && before > 0) {
      const after = spread();
      if (after > 0) moves.zoom(before / after);
    }
  });
  for (const name of ["pointerup", "pointercancel"] as const) {
    canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
  }
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      moves.zoom(Math.exp(Math.min(Math.max(event.deltaY, -120), 120) * 0.001));
    },
    { passive: false },
  );
  canvas.addEventListener("keydown", (event) => {
    const actions: { [key: string]: () => void } = {
      ArrowLeft: () => moves.turn(-KEY_TURN, 0),
      ArrowRight: () => moves.turn(KEY_TURN, 0),
      ArrowUp: () => moves.turn(0, -KEY_TURN),
      ArrowDown: () => moves.turn(0, KEY_TURN),
      "+": () => moves.zoom(1 / 1.1),
      "=": () => moves.zoom(1 / 1.1),
      "-": () => moves.zoom(1.1),
      "[": () => moves.step(-1),
      "]": () => moves.step(1),
      " ": () => moves.play(),
      Home: () => moves.reset(),
    };
    const action = actions[event.key];
    if (!action || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    action();
  });

  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    if (!divider.hasPointerCapture(event.pointerId)) return;
    const box = canvas.getBoundingClientRect();
    moves.divide((event.clientX - box.left) / box.width);
  });
  divider.addEventListener("keydown", (event) => {
    const step = event.key === "ArrowLeft" ? -0.02 : event.key === "ArrowRight" ? 0.02 : 0;
    if (step === 0) return;
    event.preventDefault();
    moves.divide(moves.dividerShare() + step);
  });
}

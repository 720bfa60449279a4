/// The object in a headset (WebXR Device API, W3C): each eye is drawn, and looks its reflections up, from where it is.

import { UserError } from "./errors";
import type { Vec3 } from "./manifest";
import { add, normalize, type Pose, scale, windowOfProjection } from "./math";
import type { Scene } from "./scene";
import type { Settings } from "./state";

/// How far from the head the object appears when the session begins, in metres of the room the person stands in.
const FIRST_DISTANCE = 0.8;

/// Where the room of the person lies in the scene: upright, turned to where the camera looks, scaled so that the camera's
/// distance from the object becomes FIRST_DISTANCE.
export interface Room {
  origin: Vec3;
  right: Vec3;
  back: Vec3;
  scale: number;
}

/// The room of a person whose head begins at a camera's place.
export function roomAt({ eye, right }: Pose, distance: number): Room {
  const level = normalize([right[0], 0, right[2]]);
  return { origin: eye, right: level, back: [-level[2], 0, level[0]], scale: distance / FIRST_DISTANCE };
}

function direction(room: Room, [x, y, z]: Vec3): Vec3 {
  return add(add(scale(x, room.right), scale(z, room.back)), [0, y, 0]);
}

/// Position and axes of an eye in the scene from its rigid transform (column-major matrix) in the room.
export function poseIn(room: Room, m: Float32Array): Pose {
  const column = (c: number): Vec3 => [m[4 * c], m[4 * c + 1], m[4 * c + 2]];
  return {
    eye: add(room.origin, scale(room.scale, direction(room, column(3)))),
    right: direction(room, column(0)),
    up: direction(room, column(1)),
    forward: scale(-1, direction(room, column(2))),
  };
}

export interface HeadsetEvents {
  drawn(): void;
  ended(): void;
  failed(failure: unknown): void;
}

/// Whether there is a headset that this browser can draw for.
export async function hasHeadset(): Promise<boolean> {
  try {
    return (await navigator.xr?.isSessionSupported("immersive-vr")) ?? false;
  } catch {
    return false;
  }
}

/// Begins a session; it ends when the person takes the headset off, or by `end` of what is returned.
export async function enterHeadset(
  scene: Scene,
  settings: Settings,
  events: HeadsetEvents,
): Promise<XRSession> {
  const { gl } = scene.renderer;
  const { xr } = navigator;
  if (!xr) throw new UserError("headset", "This browser does not know of headsets (WebXR).");
  let session: XRSession | null = null;
  let space: XRReferenceSpace;
  try {
    await gl.makeXRCompatible();
    session = await xr.requestSession("immersive-vr");
    space = await session.requestReferenceSpace("local");
  } catch (failure) {
    void session?.end();
    const reason = failure instanceof Error ? failure.message : String(failure);
    throw new UserError("headset", `The headset did not start: ${reason}.`);
  }
  const layer = new XRWebGLLayer(session, gl, { antialias: false, depth: false, alpha: false });
  await session.updateRenderState({ baseLayer: layer });
  const room = roomAt(scene.pose(settings), settings.distance);
  const here: Settings = { ...settings, compare: "off", stereo: false };
  const still = scene.manifest.axes.map(() => 0);
  const draw = (_: number, frame: XRFrame) => {
    frame.session.requestAnimationFrame(draw);
    const head = frame.getViewerPose(space);
    if (!head || gl.isContextLost()) return;
    try {
      scene.stand(here, poseIn(room, head.transform.matrix).eye);
      scene.prepare(here, still);
      for (const view of head.views) {
        const place = layer.getViewport(view);
        if (!place || place.width === 0) continue;
        const pose = poseIn(room, view.transform.matrix);
        scene.drawEye(here, pose, windowOfProjection(view.projectionMatrix), layer.framebuffer, place);
      }
      events.drawn();
    } catch (failure) {
      events.failed(failure);
      void frame.session.end();
    }
  };
  session.addEventListener("end", () => events.ended());
  session.requestAnimationFrame(draw);
  return session;
}

// Parking bays and moving objects.

import {linesOf} from "./drive.js";

const BAY_COLORS = {free: 0x3fbf5f, occupied: 0xd9534f, unknown: 0x8a93a0};
const OBJECT_COLORS = {adult: 0xffc04d, child: 0xff7fd0, car: 0x5fa8ff, bicycle: 0x9dff6a, unknown: 0xcccccc};
const ABOVE_GROUND_M = 0.04;  // so that the ground does not hide the bays
const MAX_OBJECT_AGE_S = 0.3;

export function baysOf(bays) {
  const group = new THREE.Group();
  for (const bay of bays) {
    const corners = bay.cornersM.map(([x, y]) => [x, y, bay.zM + ABOVE_GROUND_M]), color = BAY_COLORS[bay.state];
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(corners.flat()), 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    group.add(new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(
        {color, transparent: true, opacity: 0.3, depthWrite: false})));
    group.add(linesOf(corners.flatMap((corner, i) => [corner, corners[(i + 1) % 4]]), color));
  }
  return group;
}

export class Objects {
  /** Frames with `session`, `timeS` and `objects`, by time within each session. */
  constructor(frames) {
    this.frames = frames;
    this.group = new THREE.Group();
    this.shown = null;
  }

  /** Shows the objects of a time; returns a text about them. */
  show(session, time_s) {
    const near = this.frames.filter((frame) => frame.session === session && Math.abs(frame.timeS - time_s) <= MAX_OBJECT_AGE_S);
    const frame = near.sort((a, b) => Math.abs(a.timeS - time_s) - Math.abs(b.timeS - time_s))[0] || null;
    if (frame !== this.shown) {
      this.shown = frame;
      for (const old of [...this.group.children]) {
        this.group.remove(old);
        old.geometry.dispose();
        old.material.dispose();
      }
      for (const object of frame ? frame.objects : []) {
        this.group.add(prismOf(object));
      }
    }
    return frame ? frame.objects.map((object) => `${object.kind} ${object.id}`).join(", ") : "";
  }
}

/** The edges of an object, and where it goes in the next second. */
function prismOf(object) {
  const ends = [object.zM, object.zM + Math.max(object.heightM, 0.3)];
  const corners = object.footprintM, points = [];
  corners.forEach(([x, y], i) => {
    const [nextX, nextY] = corners[(i + 1) % corners.length];
    for (const z of ends) {
      points.push([x, y, z], [nextX, nextY, z]);
    }
    points.push([x, y, ends[0]], [x, y, ends[1]]);
  });
  const middle = corners.reduce(([x, y], corner) => [x + corner[0] / corners.length, y + corner[1] / corners.length], [0, 0]);
  points.push([...middle, ends[0]], [middle[0] + object.velocityMPerS[0], middle[1] + object.velocityMPerS[1], ends[0]]);
  return linesOf(points, OBJECT_COLORS[object.kind] || OBJECT_COLORS.unknown);
}

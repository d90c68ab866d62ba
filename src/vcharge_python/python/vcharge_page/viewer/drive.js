// The drives of a map: their poses over time, the car, its path and its keyframes.

// The outline of a compact car about the middle of its rear axle, for the eye.
const CAR = {front_m: 3.7, rear_m: -0.9, width_m: 1.8, height_m: 1.45};
const PATH_COLORS = [0xffd76a, 0x6ad1ff, 0xff8f6a, 0xb28cff, 0x8cff9d];
const CAMERA_SIZE_M = 0.4;
const ABOVE_GROUND_M = 0.12;  // so that the surface does not hide the path

/** Lines between pairs of points [x, y, z]. */
export function linesOf(points, color) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(Float32Array.from(points.flat()), 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color}));
}

export class Drive {
  constructor(session, number) {
    this.session = session;
    this.times_s = session.timesS;
    this.duration_s = this.times_s.length ? this.times_s[this.times_s.length - 1] : 0;
    const color = PATH_COLORS[number % PATH_COLORS.length];
    const above = session.positionsM.map(([x, y, z]) => [x, y, z + ABOVE_GROUND_M]);
    this.path = linesOf(above.slice(1).flatMap((position, i) => [above[i], position]), color);
    this.keyframes = linesOf(session.positionsM.flatMap((position, i) => this.tick(position, this.rotation(i))), color);
  }

  rotation(i) {
    return new THREE.Quaternion(...this.session.rotationsXyzw[i]);
  }

  /** A small arrow on the ground. */
  tick(position, rotation) {
    const origin = new THREE.Vector3(...position);
    const at = (x, y) => new THREE.Vector3(x, y, ABOVE_GROUND_M).applyQuaternion(rotation).add(origin).toArray();
    return [at(-0.25, 0.2), at(0.35, 0), at(0.35, 0), at(-0.25, -0.2)];
  }

  /** Sets an object to the vehicle's pose at a time, between keyframes. */
  place(object, time_s) {
    const last = this.times_s.length - 1;
    let low = 0, high = last;
    while (high - low > 1) {
      const middle = low + high >> 1;
      if (this.times_s[middle] <= time_s) {
        low = middle;
      } else {
        high = middle;
      }
    }
    const span = this.times_s[high] - this.times_s[low];
    const part = span > 0 ? Math.min(Math.max((time_s - this.times_s[low]) / span, 0), 1) : 0;
    object.position.set(...this.session.positionsM[low]).lerp(new THREE.Vector3(...this.session.positionsM[high]), part);
    object.quaternion.copy(this.rotation(low)).slerp(this.rotation(high), part);
  }
}

/** The car with its cameras. */
export function carOf(cameras) {
  const car = new THREE.Group();
  const length_m = CAR.front_m - CAR.rear_m;
  const body = new THREE.BoxGeometry(length_m, CAR.width_m, CAR.height_m);
  body.translate(CAR.front_m - 0.5 * length_m, 0, 0.5 * CAR.height_m);
  const glass = new THREE.MeshBasicMaterial({color: 0xffffff, transparent: true, opacity: 0.25, depthWrite: false});
  car.add(new THREE.Mesh(body, glass));
  car.add(new THREE.LineSegments(new THREE.EdgesGeometry(body), new THREE.LineBasicMaterial({color: 0xffffff})));
  for (const camera of cameras) {
    const s = CAMERA_SIZE_M, corners = [[-s, -s, s], [s, -s, s], [s, s, s], [-s, s, s]];
    const frame = linesOf(corners.flatMap((corner, i) => [[0, 0, 0], corner, corner, corners[(i + 1) % 4]]), 0x7fe07f);
    frame.matrixAutoUpdate = false;
    frame.matrix.fromArray(camera.vehicleFromCamera);
    car.add(frame);
  }
  return car;
}

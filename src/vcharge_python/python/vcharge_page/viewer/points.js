// Points in chunks. A chunk's first points are a sample of all, so that drawing a part of it is a coarser level.

const LARGEST = 32767;
const FIRST_BUDGET = 100000, MIN_BUDGET = 20000, MAX_BUDGET = 3000000;
const AT_REST = 8;  // times the budget are drawn when nothing moves
const POINTS_PER_PX = 0.35;  // more than that fill the chunk's area on the screen

const VERTEX_SHADER = `
precision highp float;
attribute vec4 position;
uniform mat4 modelViewMatrix, projectionMatrix;
uniform float pointSize, lowZ, highZ, centreZ, halfZ;
varying vec3 color;
vec3 ramp(float t) {
  vec3 low = mix(vec3(0.40, 0.58, 1.0), vec3(0.30, 0.90, 0.80), clamp(3.0 * t, 0.0, 1.0));
  vec3 middle = mix(low, vec3(0.95, 0.85, 0.35), clamp(3.0 * t - 1.0, 0.0, 1.0));
  return mix(middle, vec3(0.95, 0.40, 0.30), clamp(3.0 * t - 2.0, 0.0, 1.0));
}
void main() {
  vec4 seen = modelViewMatrix * vec4(position.xyz, 1.0);
  gl_Position = projectionMatrix * seen;
  gl_PointSize = clamp(pointSize / max(gl_Position.w, 0.1), 1.5, 4.0);
  float z = centreZ + halfZ * position.z;
  color = ramp(clamp((z - lowZ) / (highZ - lowZ), 0.0, 1.0)) * (0.8 + 0.2 * position.w);
}`;
const FRAGMENT_SHADER = `
precision mediump float;
varying vec3 color;
void main() { gl_FragColor = vec4(color, 1.0); }`;

export class Points {
  /** Chunks as described, and the bytes of all one after the other. Heights from low to high (m) get the colors. */
  constructor(chunks, bytes, low_m, high_m) {
    this.group = new THREE.Group();
    this.budget = FIRST_BUDGET;
    this.drawn = 0;
    let offset = 0;
    this.chunks = chunks.map((chunk) => {
      const packed = new Int16Array(bytes.buffer, bytes.byteOffset + offset, 4 * chunk.count);
      offset += 8 * chunk.count;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(packed, 4, true));
      const material = new THREE.RawShaderMaterial({
        vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER,
        uniforms: {pointSize: {value: 100}, lowZ: {value: low_m}, highZ: {value: high_m}, centreZ: {value: chunk.centreM[2]},
                   halfZ: {value: chunk.halfM[2]}}});
      const mesh = new THREE.Points(geometry, material);
      mesh.frustumCulled = false;  // the chunk's own box is used
      mesh.matrixAutoUpdate = false;
      mesh.matrix.makeScale(...chunk.halfM).setPosition(new THREE.Vector3(...chunk.centreM));
      this.group.add(mesh);
      const centre = new THREE.Vector3(...chunk.centreM), half = new THREE.Vector3(...chunk.halfM);
      return {mesh, packed, centre, half, count: chunk.count, radius: half.length(), weight: 0,
              box: new THREE.Box3(centre.clone().sub(half), centre.clone().add(half))};
    });
  }

  /** Gives each visible chunk a part of the budget by its size on the screen; a larger budget with `isAtRest`. */
  select(camera, width_px, height_px, isAtRest) {
    const frustum = new THREE.Frustum().setFromMatrix(
        new THREE.Matrix4().multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse));
    const pixelsPerRadian = height_px / (2 * Math.tan(camera.fov * Math.PI / 360));
    const visible = [];
    for (const chunk of this.chunks) {
      chunk.mesh.visible = frustum.intersectsBox(chunk.box);
      if (chunk.mesh.visible) {
        const distance = Math.max(chunk.box.distanceToPoint(camera.position), 0.5 * chunk.radius, 0.1);
        const side_px = 2 * chunk.radius / distance * pixelsPerRadian;
        chunk.weight = Math.min(side_px * side_px, width_px * height_px);
        visible.push(chunk);
      }
    }
    const budget = isAtRest ? Math.min(AT_REST * this.budget, MAX_BUDGET) : this.budget;
    const factor = shareFactor(visible, budget);
    this.drawn = 0;
    this.isWhole = factor === POINTS_PER_PX;
    for (const chunk of visible) {
      const number = pointsOf(chunk, factor);
      chunk.mesh.geometry.setDrawRange(0, number);
      // Fewer points are drawn larger, so that a coarser level is no darker.
      chunk.mesh.material.uniforms.pointSize.value = 0.05 * pixelsPerRadian * Math.min(Math.sqrt(chunk.count / number), 2.5);
      this.drawn += number;
    }
  }

  /** Changes the budget, by little at once; not if few points or all are drawn: then other things take the time. */
  adapt(factor) {
    if (factor < 1 ? this.drawn > MIN_BUDGET : !this.isWhole) {
      const bounded = Math.min(Math.max(factor, 0.5), 1.2);
      this.budget = Math.min(Math.max(Math.round(bounded * this.budget), MIN_BUDGET), MAX_BUDGET);
    }
  }

  /** The drawn point nearest to the camera within `radius` of a position on the screen, both in normalized coordinates; or null. */
  pick(camera, x, y, radius, aspect) {
    const toScreen = new THREE.Matrix4(), point = new THREE.Vector4();
    let best = null, nearest = Infinity;
    for (const chunk of this.chunks.filter((one) => one.mesh.visible)) {
      toScreen.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse).multiply(chunk.mesh.matrix);
      const number = chunk.mesh.geometry.drawRange.count;
      for (let i = 0; i < number; ++i) {
        const packed = chunk.packed, k = 4 * i;
        point.set(packed[k] / LARGEST, packed[k + 1] / LARGEST, packed[k + 2] / LARGEST, 1).applyMatrix4(toScreen);
        if (point.w <= 0 || point.w >= nearest) {
          continue;
        }
        if (Math.hypot((point.x / point.w - x) * aspect, point.y / point.w - y) < radius) {
          nearest = point.w;
          best = new THREE.Vector3(packed[k], packed[k + 1], packed[k + 2]).divideScalar(LARGEST);
          best.multiply(chunk.half).add(chunk.centre);
        }
      }
    }
    return best;
  }
}

function pointsOf(chunk, factor) {
  return Math.max(1, Math.floor(Math.min(chunk.count, factor * chunk.weight)));
}

/** Points per pixel with which the chunks take the budget together; what is full leaves its part to the others. */
function shareFactor(visible, budget) {
  let low = 0, high = POINTS_PER_PX;
  const total = (factor) => visible.reduce((sum, chunk) => sum + pointsOf(chunk, factor), 0);
  if (total(high) <= budget) {
    return high;
  }
  for (let i = 0; i < 20; ++i) {
    const middle = 0.5 * (low + high);
    if (total(middle) > budget) {
      high = middle;
    } else {
      low = middle;
    }
  }
  return low;
}

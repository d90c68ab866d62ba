// The surface of a height map: a grid of triangles with a picture over it.

const UNKNOWN = -32768, LARGEST = 32767;
const COARSE_STEP = 4;  // of the cells that are drawn while the view of a slow computer moves

export class Surface {
  /** `given`: the description; `bytes`: heights, int16, rows along y; `address`: of the picture, after which `onLoad` is called. */
  constructor(given, bytes, address, onLoad) {
    this.given = given;
    const packed = new Int16Array(bytes.buffer, bytes.byteOffset, given.rows * given.columns);
    this.heights = Float32Array.from(packed, (value) => value === UNKNOWN ? NaN :
        given.lowM + (value + LARGEST) / (2 * LARGEST) * (given.highM - given.lowM));
    const texture = new THREE.Texture(new Image());
    texture.flipY = false;  // row 0 is at the smallest y
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    texture.image.onload = () => {
      texture.needsUpdate = true;
      onLoad();
    };
    texture.image.src = address;
    const material = new THREE.MeshBasicMaterial({map: texture, side: THREE.DoubleSide});
    this.fine = new THREE.Mesh(this.geometryOf(1), material);
    this.coarse = new THREE.Mesh(this.geometryOf(COARSE_STEP), material);
    this.mesh = new THREE.Group().add(this.fine, this.coarse);
    this.setFine(true);
  }

  setFine(isFine) {
    this.fine.visible = isFine;
    this.coarse.visible = !isFine;
  }

  /** Triangles between neighbours among every `step`-th height of both directions. */
  geometryOf(step) {
    const {originM, cellM, pictureCornerM, pictureSizeM} = this.given;
    const rows = Math.ceil(this.given.rows / step), columns = Math.ceil(this.given.columns / step);
    const positions = new Float32Array(3 * rows * columns), uvs = new Float32Array(2 * rows * columns);
    const indices = new Uint32Array(6 * rows * columns);
    const known = new Uint8Array(rows * columns);
    for (let row = 0, i = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column, ++i) {
        const z = this.heights[row * step * this.given.columns + column * step];
        known[i] = Number.isNaN(z) ? 0 : 1;
        const x = positions[3 * i] = originM[0] + column * step * cellM, y = positions[3 * i + 1] = originM[1] + row * step * cellM;
        positions[3 * i + 2] = known[i] ? z : 0;
        uvs[2 * i] = (x - pictureCornerM[0]) / pictureSizeM[0];
        uvs[2 * i + 1] = (y - pictureCornerM[1]) / pictureSizeM[1];
      }
    }
    let number = 0;
    for (let row = 0; row + 1 < rows; ++row) {
      for (let column = 0; column + 1 < columns; ++column) {
        const i = row * columns + column;
        if (known[i] && known[i + 1] && known[i + columns] && known[i + columns + 1]) {
          for (const corner of [i, i + 1, i + columns + 1, i, i + columns + 1, i + columns]) {
            indices[number++] = corner;
          }
        }
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setAttribute("uv", new THREE.BufferAttribute(uvs, 2));
    geometry.setIndex(new THREE.BufferAttribute(indices.subarray(0, number), 1));
    return geometry;
  }

  /** Height at a position, or NaN. */
  heightAt(x, y) {
    const {rows, columns, originM, cellM} = this.given;
    const column = Math.round((x - originM[0]) / cellM), row = Math.round((y - originM[1]) / cellM);
    return column >= 0 && row >= 0 && column < columns && row < rows ? this.heights[row * columns + column] : NaN;
  }

  /** Where a ray first meets the surface within `reach_m`, or null. */
  hit(ray, reach_m) {
    const step_m = 0.5 * this.given.cellM, point = new THREE.Vector3();
    for (let along_m = 0; along_m < reach_m; along_m += step_m) {
      ray.at(along_m, point);
      const height = this.heightAt(point.x, point.y);
      if (point.z <= height) {
        return point.setZ(height);
      }
    }
    return null;
  }
}

// The surface of a height map: a grid of triangles with a picture over it.

const UNKNOWN = -32768, LARGEST = 32767;

export class Surface {
  /** `given`: the description; `bytes`: heights, int16, rows along y; `address`: the picture; `onLoad` is called once it is there. */
  constructor(given, bytes, address, onLoad) {
    this.given = given;
    const packed = new Int16Array(bytes.buffer, bytes.byteOffset, given.rows * given.columns);
    this.heights = Float32Array.from(packed, (value) => value === UNKNOWN ? NaN :
        given.lowM + (value + LARGEST) / (2 * LARGEST) * (given.highM - given.lowM));
    const geometry = this.geometryOf();
    const texture = new THREE.Texture(new Image());
    texture.flipY = false;  // row 0 is at the smallest y
    texture.minFilter = THREE.LinearFilter;
    texture.generateMipmaps = false;
    texture.image.onload = () => {
      texture.needsUpdate = true;
      onLoad();
    };
    texture.image.src = address;
    this.mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({map: texture, side: THREE.DoubleSide}));
  }

  geometryOf() {
    const {rows, columns, originM, cellM, pictureCornerM, pictureSizeM} = this.given;
    const positions = new Float32Array(3 * rows * columns), uvs = new Float32Array(2 * rows * columns);
    const indices = [];
    for (let row = 0, i = 0; row < rows; ++row) {
      for (let column = 0; column < columns; ++column, ++i) {
        const x = originM[0] + column * cellM, y = originM[1] + row * cellM, z = this.heights[i];
        positions.set([x, y, Number.isNaN(z) ? 0 : z], 3 * i);
        uvs.set([(x - pictureCornerM[0]) / pictureSizeM[0], (y - pictureCornerM[1]) / pictureSizeM[1]], 2 * i);
        const corners = [i, i + 1, i + columns, i + columns + 1];
        if (row + 1 < rows && column + 1 < columns && corners.every((corner) => !Number.isNaN(this.heights[corner]))) {
          indices.push(i, i + 1, i + columns + 1, i, i + columns + 1, i + columns);
        }
      }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
    geometry.setAttribute("uv", new THREE.BufferAttribute(uvs, 2));
    geometry.setIndex(new THREE.BufferAttribute(Uint32Array.from(indices), 1));
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

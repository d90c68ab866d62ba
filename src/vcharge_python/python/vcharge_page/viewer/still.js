// What stands still is drawn once per view and kept, so that the car and the objects move over it at little cost.

const VERTEX_SHADER = `
varying vec2 at;
void main() {
  at = uv;
  gl_Position = vec4(position.xy, 0.0, 1.0);
}`;
const FRAGMENT_SHADER = `
uniform sampler2D colors, depths;
varying vec2 at;
void main() {
  gl_FragColor = texture2D(colors, at);
  gl_FragDepthEXT = texture2D(depths, at).r;
}`;

export class StillPicture {
  constructor(renderer) {
    this.renderer = renderer;
    this.target = new THREE.WebGLRenderTarget(1, 1, {minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter});
    this.target.depthTexture = new THREE.DepthTexture(1, 1, THREE.FloatType);
    const material = new THREE.ShaderMaterial({
      vertexShader: VERTEX_SHADER, fragmentShader: FRAGMENT_SHADER, extensions: {fragDepth: true}, depthFunc: THREE.AlwaysDepth,
      uniforms: {colors: {value: this.target.texture}, depths: {value: this.target.depthTexture}}});
    const quad = new THREE.Mesh(new THREE.PlaneBufferGeometry(2, 2), material);
    quad.frustumCulled = false;
    this.scene = new THREE.Scene();
    this.scene.add(quad);
  }

  /** Draws and keeps a scene. */
  draw(scene, camera) {
    const {width, height} = this.renderer.domElement;
    this.target.setSize(width, height);
    this.renderer.setRenderTarget(this.target);
    this.renderer.clear();
    this.renderer.render(scene, camera);
    this.renderer.setRenderTarget(null);
  }

  /** Puts the picture on the screen, with its depths. */
  show(camera) {
    this.renderer.render(this.scene, camera);
  }
}

#!/bin/sh
# Makes three.min.js, the parts of three.js that stand_view.html uses, in a folder of its own (npm, network).
set -e
target=$(cd "$(dirname "$0")/.." && pwd)/treedgs_geo/inventory/templates/three.min.js
cd "$(mktemp -d)"
npm install three@0.187.0 esbuild@0.28.2
cat > entry.js <<'END'
export {
  BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, Group, HemisphereLight, LineBasicMaterial,
  LineLoop, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Points, Scene, ShaderMaterial,
  SRGBColorSpace, Texture, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
END
npx esbuild entry.js --bundle --minify --format=iife --global-name=THREE --target=es2017 --charset=ascii \
  --legal-comments=none --banner:js="/*! three.js 0.187.0: $(cat node_modules/three/LICENSE) */" --outfile="$target"

// run_three.mjs JOB.json FOLDER: renders the job that run_three.py states, and prints a line of JSON for each setting.

import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { Buffer } from 'node:buffer';
import process from 'node:process';

globalThis.self ??= globalThis;
globalThis.requestAnimationFrame = () => 0;
globalThis.cancelAnimationFrame = () => {};

if ( ! await navigator.gpu?.requestAdapter() ) {

	console.error( 'WebGPU finds no adapter' );
	process.exit( 1 );

}

const THREE = await import( 'three/webgpu' );
const { LightProbeGrid } = await import( 'three/addons/lighting/LightProbeGrid.js' );

// The least time of so many runs counts; no more of them after so many seconds.
const RUNS = 5;
const ENOUGH = 5;

const [ jobFile, folder ] = process.argv.slice( 2 );
const job = JSON.parse( readFileSync( jobFile, 'utf8' ) );
const [ width, height ] = job.size;

const bytes = ( text ) => {

	const buffer = Buffer.from( text, 'base64' );
	return buffer.buffer.slice( buffer.byteOffset, buffer.byteOffset + buffer.length );

};

// A canvas that is never shown.
const canvas = {
	width, height, style: {}, addEventListener() {}, removeEventListener() {},
	getContext: () => ( { configure() {}, unconfigure() {}, getCurrentTexture() { throw new Error( 'the canvas is not for drawing' ); } } ),
};

// The scenes' lights have no range, and their nodes say so by a constant. Where a shader branches on a uniform alone, Mesa's
// lavapipe (22.3) puts the uniform's value in and compiles for each draw anew: an image the same to the bit, fifty and more
// times later, and gigabytes of compiled code that stay.
for ( const [ kind, node ] of [ [ THREE.PointLight, THREE.PointLightNode ], [ THREE.SpotLight, THREE.SpotLightNode ] ] ) {

	kind.registerNode( class extends node {

		constructor( light ) {

			super( light );
			this.cutoffDistanceNode = THREE.TSL.float( 0 );

		}

	} );

}

const renderer = new THREE.WebGPURenderer( { canvas, antialias: false } );
await renderer.init();
renderer.shadowMap.enabled = true;
renderer.shadowMap.type = THREE.BasicShadowMap;
renderer.toneMapping = THREE.NoToneMapping;
renderer.outputColorSpace = THREE.LinearSRGBColorSpace;

const scene = new THREE.Scene();
const materials = job.materials.map( ( m ) => {

	const material = new THREE.MeshLambertNodeMaterial( { side: m.double_sided ? THREE.DoubleSide : THREE.FrontSide } );
	material.color.setRGB( ...m.albedo, THREE.LinearSRGBColorSpace );
	material.emissive.setRGB( ...m.emission, THREE.LinearSRGBColorSpace );
	material.shadowSide = THREE.DoubleSide;

	if ( m.picture !== null ) {

		const texture = new THREE.DataTexture( new Uint16Array( bytes( m.picture.texels ) ), m.picture.width, m.picture.height, THREE.RGBAFormat, THREE.HalfFloatType );
		texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
		texture.magFilter = THREE.LinearFilter;
		texture.minFilter = THREE.LinearMipmapLinearFilter;
		texture.generateMipmaps = true;
		texture.needsUpdate = true;
		material.map = texture;

	}

	return material;

} );

const emits = job.materials.some( ( m ) => Math.max( ...m.emission ) > 0 );
const box = new THREE.Box3();

for ( const m of job.meshes ) {

	let geometry = new THREE.BufferGeometry();
	geometry.setAttribute( 'position', new THREE.BufferAttribute( new Float32Array( bytes( m.positions ) ), 3 ) );
	if ( m.uv !== null ) geometry.setAttribute( 'uv', new THREE.BufferAttribute( new Float32Array( bytes( m.uv ) ), 2 ) );
	geometry.setIndex( new THREE.BufferAttribute( new Uint32Array( bytes( m.faces ) ), 1 ) );

	if ( m.normals !== null ) {

		geometry.setAttribute( 'normal', new THREE.BufferAttribute( new Float32Array( bytes( m.normals ) ), 3 ) );

	} else {

		geometry = geometry.toNonIndexed();
		geometry.computeVertexNormals();

	}

	const mesh = new THREE.Mesh( geometry, materials[ m.material ] );
	mesh.castShadow = mesh.receiveShadow = true;
	scene.add( mesh );
	geometry.computeBoundingBox();
	box.union( geometry.boundingBox );

}

const extent = box.getSize( new THREE.Vector3() );
const diagonal = extent.length();

for ( const l of job.lights ) {

	const strength = Math.max( ...l.intensity, 1e-20 );
	const color = new THREE.Color().setRGB( ...l.intensity.map( ( x ) => x / strength ), THREE.LinearSRGBColorSpace );
	let light;

	if ( l.kind === 'point' ) {

		light = new THREE.PointLight( color, strength, 0, 2 );

	} else {

		light = new THREE.SpotLight( color, strength, 0, l.outer, 1 - Math.min( l.inner / l.outer, 1 ), 2 );
		light.target.position.set( ...l.position ).add( new THREE.Vector3( ...l.direction ) );
		scene.add( light.target );

	}

	light.position.set( ...l.position );
	light.castShadow = true;
	light.shadow.mapSize.set( 1024, 1024 );
	light.shadow.camera.near = diagonal * 1e-3;
	light.shadow.camera.far = diagonal * 2;
	light.shadow.bias = 0;
	light.shadow.normalBias = diagonal * 2e-3;
	scene.add( light );

}

const camera = new THREE.PerspectiveCamera( job.camera.yfov * 180 / Math.PI, width / height, diagonal * 1e-4, diagonal * 4 );
const axes = [ job.camera.right, job.camera.up, job.camera.forward.map( ( x ) => - x ) ].map( ( a ) => new THREE.Vector3( ...a ) );
camera.quaternion.setFromRotationMatrix( new THREE.Matrix4().makeBasis( ...axes ) );
camera.position.set( ...job.camera.position );
camera.updateMatrixWorld();

const target = new THREE.RenderTarget( width, height, { type: THREE.FloatType, minFilter: THREE.NearestFilter, magFilter: THREE.NearestFilter, colorSpace: THREE.LinearSRGBColorSpace } );
const done = () => renderer.backend.device.queue.onSubmittedWorkDone();

const draw = () => {

	renderer.setRenderTarget( target );
	renderer.clear();
	renderer.render( scene, camera );

};

const image = async ( name ) => {

	draw();
	const read = await renderer.readRenderTargetPixelsAsync( target, 0, 0, width, height );
	writeFileSync( join( folder, name ), new Uint8Array( read.buffer, read.byteOffset, width * height * 16 ) );
	return name;

};

for ( const [ index, setting ] of job.settings.entries() ) {

	const grid = new LightProbeGrid( extent.x, extent.y, extent.z, setting.grid, setting.grid, setting.grid );
	box.getCenter( grid.position );
	grid.updateBoundingBox();
	grid.updateMatrixWorld();
	scene.add( grid );
	// The pass before the first extra one captures the lights' direct light: it is the first bounce. What materials emit is
	// itself caught by that pass, and its first bounce by the next.
	const bounces = setting.bounces - ( emits ? 0 : 1 );
	const options = { cubemapSize: setting.face, near: diagonal * 1e-3, far: diagonal * 2, bounces };
	const whole = async () => {

		grid.bake( renderer, scene, options );
		draw();
		await done();

	};

	await whole();
	let [ seconds, spent ] = [ Infinity, 0 ];

	for ( let run = 0; run < RUNS && spent < ENOUGH; run ++ ) {

		const start = performance.now();
		await whole();
		const took = ( performance.now() - start ) / 1e3;
		seconds = Math.min( seconds, took );
		spent += took;

	}

	const full = await image( `${ index }_full.raw` );

	if ( emits ) {

		// Light that the probes bring is direct where nothing has reflected it.
		const colors = materials.map( ( m ) => m.color.clone() );
		materials.forEach( ( m ) => m.color.setScalar( 0 ) );
		grid.bake( renderer, scene, { ...options, bounces: 0 } );
		materials.forEach( ( m, k ) => m.color.copy( colors[ k ] ) );

	} else {

		grid.intensity = 0;

	}

	const direct = await image( `${ index }_direct.raw` );
	console.log( JSON.stringify( { index, seconds, full, direct, version: `r${ THREE.REVISION }` } ) );
	scene.remove( grid );
	grid.dispose();

}

process.exit( 0 );

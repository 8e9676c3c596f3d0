// poses.mjs MODEL… prints where three.js puts the vertices of each model at five times, as JSON.

import { readFileSync } from 'node:fs';
import process from 'node:process';

globalThis.self ??= globalThis;
globalThis.ProgressEvent ??= class {};

const THREE = await import( 'three' );
const { GLTFLoader } = await import( 'three/addons/loaders/GLTFLoader.js' );

// Shares of the animation's length.
const TIMES = [ 0, 0.13, 0.42, 0.71, 0.97 ];
// Of a model's vertices at most so many are stated, evenly apart.
const MOST = 400;

// The model without its materials: images need a browser.
const bare = ( bytes ) => {

	const length = bytes.readUInt32LE( 12 );
	const model = JSON.parse( bytes.subarray( 20, 20 + length ).toString() );
	for ( const key of [ 'materials', 'textures', 'images', 'samplers' ] ) delete model[ key ];
	for ( const mesh of model.meshes ) for ( const primitive of mesh.primitives ) delete primitive.material;
	const text = Buffer.from( JSON.stringify( model ) );
	const json = Buffer.concat( [ text, Buffer.alloc( - text.length & 3, ' ' ) ] );
	const rest = bytes.subarray( 20 + length );
	const head = Buffer.alloc( 20 );
	[ 0x46546C67, 2, 20 + json.length + rest.length, json.length, 0x4E4F534A ].forEach( ( word, i ) => head.writeUInt32LE( word, 4 * i ) );
	return Uint8Array.from( Buffer.concat( [ head, json, rest ] ) ).buffer;

};

const models = [];
for ( const file of process.argv.slice( 2 ) ) {

	const gltf = await new GLTFLoader().parseAsync( bare( readFileSync( file ) ), '' );
	const clip = gltf.animations[ 0 ];
	const duration = clip?.duration ?? 0;
	const mixer = new THREE.AnimationMixer( gltf.scene );
	if ( clip ) mixer.clipAction( clip ).play();
	const meshes = [];
	gltf.scene.traverse( ( node ) => node.isMesh && meshes.push( node ) );
	const count = meshes.reduce( ( sum, mesh ) => sum + mesh.geometry.attributes.position.count, 0 );
	const vertices = [];
	const times = TIMES.map( ( share ) => share * duration );
	times.forEach( ( time, t ) => {

		mixer.setTime( time );
		gltf.scene.updateMatrixWorld( true );
		let number = 0;
		let stated = 0;
		for ( const mesh of meshes ) for ( let i = 0; i < mesh.geometry.attributes.position.count; i ++, number ++ ) {

			if ( Math.floor( number * MOST / count ) === Math.floor( ( number - 1 ) * MOST / count ) ) continue;
			const rest = new THREE.Vector3().fromBufferAttribute( mesh.geometry.attributes.position, i );
			const at = mesh.getVertexPosition( i, new THREE.Vector3() ).applyMatrix4( mesh.matrixWorld );
			if ( t === 0 ) vertices.push( { rest: rest.toArray(), at: [] } );
			vertices[ stated ++ ].at.push( at.toArray().map( ( x ) => Number( x.toFixed( 6 ) ) ) );

		}

	} );
	models.push( { model: file, times, vertices } );

}

console.log( JSON.stringify( { renderer: `three.js r${ THREE.REVISION }`, models } ) );

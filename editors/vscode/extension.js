// Starts `lightgraph lsp` for graphs and shaders.
const path = require('path');
const { commands, window, workspace } = require('vscode');
const { LanguageClient } = require('vscode-languageclient/node');

let client;

// A path of the settings, from the first folder that is open.
function resolved(file) {
    const folder = workspace.workspaceFolders?.[0]?.uri.fsPath ?? '';
    return path.resolve(folder, file);
}

async function start() {
    const settings = workspace.getConfiguration('lightgraph');
    const scene = settings.get('scene');
    const server = { command: settings.get('path'), args: ['lsp'] };
    const documents = [
        { scheme: 'file', language: 'ron' },
        { scheme: 'file', language: 'wgsl' },
    ];
    const options = {
        documentSelector: documents,
        initializationOptions: {
            scene: scene ? resolved(scene) : null,
            shaders: settings.get('shaders').map(resolved),
        },
    };
    client = new LanguageClient('lightgraph', 'lightgraph', server, options);
    try {
        await client.start();
    } catch (error) {
        window.showErrorMessage(`lightgraph can't be started: ${error.message}. Set "lightgraph.path" to where it is.`);
    }
}

async function stop() {
    const running = client;
    client = undefined;
    // One that never started can't be stopped.
    await running?.stop().catch(() => {});
}

async function restart() {
    await stop();
    await start();
}

exports.activate = async (context) => {
    const changed = workspace.onDidChangeConfiguration((e) => e.affectsConfiguration('lightgraph') && restart());
    context.subscriptions.push(commands.registerCommand('lightgraph.restart', restart), changed);
    await start();
};

exports.deactivate = stop;

-- The session of scripts/neovim.sh: written for Neovim 0.7, which Debian has, and newer ones.
local function fail(message)
    io.stderr:write("neovim: " .. message .. "\n")
    vim.cmd("cquit 1")
end

local function wait(what, so)
    if not vim.wait(120000, so, 20) then
        fail("waited in vain for " .. what)
    end
end

local function diagnostics()
    return vim.diagnostic.get(0)
end

local buffer = vim.api.nvim_get_current_buf()
vim.bo[buffer].filetype = "ron"
local id = vim.lsp.start_client({ name = "lightgraph", cmd = { "lightgraph", "lsp" }, root_dir = vim.fn.getcwd() })
vim.lsp.buf_attach_client(buffer, id)
local client = vim.lsp.get_client_by_id(id)

wait("the fault", function() return #diagnostics() > 0 end)
local fault = diagnostics()[1]
if not fault.message:find("colour") then
    fail("another fault: " .. fault.message)
end

local function request(method, params)
    local answer = client.request_sync(method, params, 60000, buffer)
    if not answer or answer.err or not answer.result then
        fail(method .. ": " .. vim.inspect(answer))
    end
    return answer.result
end

-- The remedy of the fault, as `vim.lsp.buf.code_action` asks for it.
local document = { uri = vim.uri_from_bufnr(buffer) }
local start = { line = fault.lnum, character = fault.col }
local told = {
    range = { start = start, ["end"] = { line = fault.end_lnum, character = fault.end_col } },
    message = fault.message,
    severity = fault.severity,
    source = fault.source,
}
local actions = request("textDocument/codeAction", {
    textDocument = document,
    range = told.range,
    context = { diagnostics = { told } },
})
if not actions[1] then
    fail("no remedy: " .. vim.inspect(actions))
end
vim.lsp.util.apply_workspace_edit(actions[1].edit, client.offset_encoding)
wait("the remedy", function() return #diagnostics() == 0 end)

-- A rename, in files that are open and in others.
local lines = vim.api.nvim_buf_get_lines(buffer, 0, -1, false)
local place
for row, line in ipairs(lines) do
    local column = line:find("brightness", 1, true)
    if column and not place then
        place = { line = row - 1, character = column }
    end
end
local edit = request("textDocument/rename", { textDocument = document, position = place, newName = "strength" })
vim.lsp.util.apply_workspace_edit(edit, client.offset_encoding)
vim.cmd("silent wall")
vim.cmd("qall!")

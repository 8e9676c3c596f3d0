-- `lightgraph lsp` in Neovim 0.11 and newer, where `vim.o.exrc = true`.
vim.filetype.add({ extension = { ron = "ron", wgsl = "wgsl" } })
vim.lsp.config("lightgraph", {
    cmd = { "lightgraph", "lsp" },
    filetypes = { "ron", "wgsl" },
    root_markers = { "graphs", ".git" },
})
vim.lsp.enable("lightgraph")

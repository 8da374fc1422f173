return {
  cmd = { "rbxcompose", "lsp" },
  filetypes = { "yaml" },
  root_markers = { "robots", "missions", ".git" },
}

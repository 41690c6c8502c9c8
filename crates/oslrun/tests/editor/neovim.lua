-- What a user of Neovim does with a shader, through its built-in client. Each step checks its result; the
-- first wrong one ends Neovim with an error.

local function fail(text)
    io.stderr:write(text .. '\n')
    vim.cmd('cquit 1')
end

local function check(ok, what)
    if not ok then
        fail('wrong: ' .. what)
        error(what)
    end
end

local function run()
    local id = vim.lsp.start_client({
        name = 'oslrun',
        cmd = { vim.env.OSLRUN, 'lsp' },
        root_dir = vim.fn.expand('%:p:h'),
    })
    check(id, 'the client starts')
    vim.lsp.buf_attach_client(0, id)
    local function ask(method, params)
        local answers, why = vim.lsp.buf_request_sync(0, method, params, 20000)
        check(answers and answers[id], method .. ': ' .. tostring(why))
        check(not answers[id].error, method .. ': ' .. vim.inspect(answers[id].error))
        return answers[id].result
    end
    -- The cursor on a part of the text.
    local function go(part, further)
        vim.fn.cursor(1, 1)
        check(vim.fn.search('\\V' .. part, 'cW') > 0, 'the text has ' .. part)
        vim.fn.cursor(vim.fn.line('.'), vim.fn.col('.') + (further or 0))
        return vim.lsp.util.make_position_params(0, 'utf-16')
    end
    local function text()
        return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, false), '\n')
    end
    local function apply(edit)
        vim.lsp.util.apply_workspace_edit(edit, 'utf-16')
    end
    local function codes()
        local list = {}
        for _, found in ipairs(vim.diagnostic.get(0)) do
            list[#list + 1] = found.code
        end
        return table.concat(list, ' ')
    end

    -- The published file has slips; the server shows them and repairs them.
    check(vim.wait(20000, function() return #vim.diagnostic.get(0) > 0 end), 'diagnostics')
    local before = codes()
    local params = vim.lsp.util.make_range_params(0, 'utf-16')
    params.context = { diagnostics = {}, only = { 'source.fixAll' } }
    local actions = ask('textDocument/codeAction', params)
    check(#actions == 1, 'one action repairs all: ' .. before)
    apply(actions[1].edit)
    check(vim.wait(20000, function() return codes() ~= before end), 'fewer diagnostics after the fix')

    -- A new slip, as it is typed, and its fix.
    vim.fn.cursor(vim.fn.line('$'), 1)
    vim.fn.append(vim.fn.search('^}', 'bcW') - 1, '    float typed = nosie(P);')
    check(vim.wait(20000, function() return codes():find('E0201') end), 'the slip has a diagnostic: ' .. codes())
    go('nosie')
    params = vim.lsp.util.make_range_params(0, 'utf-16')
    params.context = { diagnostics = {}, only = { 'quickfix' } }
    actions = ask('textDocument/codeAction', params)
    check(#actions > 0, 'the slip has a fix')
    apply(actions[1].edit)
    check(text():find('float typed = noise%(P%);'), 'the fix writes noise')

    local hover = ask('textDocument/hover', go('noise(P)'))
    check(hover.contents.value:find('noise'), 'hover')
    local items = ask('textDocument/completion', go('typed = noise', 10))
    local labels = {}
    for _, item in ipairs(items) do
        labels[item.label] = true
    end
    check(labels.noise and labels.smoothstep and labels.P, 'completion')
    local help = ask('textDocument/signatureHelp', go('noise(P)', 6))
    check(#help.signatures > 1, 'signature help')

    -- The definition of a parameter, its references, and another name for it.
    local uses = ask('textDocument/definition', go('typed'))
    check(#uses == 1 and uses[1].range.start.line == vim.fn.line('.') - 1, 'definition')
    params = go('typed')
    params.newName = 'chosen'
    apply(ask('textDocument/rename', params))
    check(text():find('float chosen') and not text():find('typed'), 'rename')
    check(#ask('textDocument/documentSymbol', params) > 0, 'document symbols')

    local edits = ask('textDocument/formatting', vim.lsp.util.make_formatting_params({}))
    vim.lsp.util.apply_text_edits(edits, 0, 'utf-16')
    check(#ask('textDocument/formatting', vim.lsp.util.make_formatting_params({})) == 0, 'a formatted text stays')
    vim.lsp.stop_client(id)
    check(vim.wait(5000, function() return vim.lsp.client_is_stopped(id) end), 'the server leaves')
    io.stderr:write('all served\n')
end

local ok, why = pcall(run)
if not ok then
    fail(tostring(why))
end
vim.cmd('qall!')

# SPDX-License-Identifier: GPL-2.0-only
"""The directive `notebook` shows a Jupyter notebook with its stored outputs, without a program of Jupyter."""

import json
import os
import re

from docutils import nodes
from docutils.parsers.rst import Directive
from docutils.statemachine import StringList
from sphinx.util.nodes import nested_parse_with_titles

UNDERLINES = {2: '-', 3: '^'}    # those of the pages below their title


def rst_of(markdown):
    """Returns lines of reStructuredText for Markdown with headings, lists, code, emphasis and links; leaves out a heading of level 1."""
    lines = []
    for line in markdown.splitlines():
        heading = re.fullmatch(r'(#+) (.*)', line)
        text = heading.group(2) if heading else line
        text = re.sub(r'`([^`]+)`', r'``\1``', text)
        text = re.sub(r'\[([^\]]+)\]\(([^)]+)\)', r'`\1 <\2>`__', text)
        if not heading:
            lines.append(text)
        elif len(heading.group(1)) > 1:
            lines += [text, UNDERLINES[len(heading.group(1))] * len(text)]
    return lines + ['']


def literal(text, language, classes=()):
    node = nodes.literal_block(text, text, language=language, classes=list(classes))
    node['force'] = False
    return node


def nodes_of(output):
    """Returns nodes of a stored output: text as a literal block, a picture as an image in the page."""
    data = output.get('data', {})
    if 'image/png' in data:
        picture = ''.join(''.join(data['image/png']).split())
        return [nodes.image(uri='data:image/png;base64,' + picture, alt='output of this cell')]
    text = ''.join(output.get('text') or data.get('text/plain', ''))
    return [literal(text.rstrip('\n'), 'none', ['notebook-output'])] if text else []


class Notebook(Directive):
    """`.. notebook:: file` shows the cells of a notebook in their order; the path is relative to the page."""
    required_arguments = 1

    def run(self):
        env = self.state.document.settings.env
        path = os.path.normpath(os.path.join(os.path.dirname(env.doc2path(env.docname)), self.arguments[0]))
        env.note_dependency(path)
        with open(path, encoding='utf-8') as file:
            cells = json.load(file)['cells']
        parent = nodes.section()
        parent.document = self.state.document
        for cell in cells:
            source = ''.join(cell['source'])
            if cell['cell_type'] == 'markdown':
                nested_parse_with_titles(self.state, StringList(rst_of(source), path), parent)
                continue
            # what a heading began goes on until the next one
            place = parent.children[-1] if parent.children and isinstance(parent.children[-1], nodes.section) else parent
            place += literal(source, 'python')
            for output in cell.get('outputs', []):
                place += nodes_of(output)
        return parent.children


def setup(app):
    app.add_directive('notebook', Notebook)
    return {'version': '1', 'parallel_read_safe': True, 'parallel_write_safe': True}

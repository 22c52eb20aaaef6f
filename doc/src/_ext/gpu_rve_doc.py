"""What these pages need beyond Sphinx: the language LAMMPS, links to LAMMPS' own pages, and the table of bench/results."""

import json
import os
import re

from docutils import nodes
from docutils.parsers.rst import Directive
from pygments.lexer import RegexLexer
from pygments.token import Comment, Keyword, Name, Number, Operator, String, Text

LAMMPS_MANUAL = 'https://docs.lammps.org/'

# Pages that are, or would be, ours: a reference to a missing one of these is a warning, not a link to LAMMPS.
OURS = re.compile(r'rve|mpm|random|gpu|theory|accuracy|performance|architecture|install|units_notation|changelog|failure|styles')


class LammpsLexer(RegexLexer):
    """Input scripts of LAMMPS: comments, strings, variables, references, numbers, and the command at the start of a line."""
    name = 'LAMMPS'
    aliases = ['LAMMPS', 'lammps']
    tokens = {
        'root': [
            (r'#.*', Comment),
            (r'"[^"]*"|\'[^\']*\'', String),
            (r'\$\{[^}]*\}|\$\([^)]*\)|\$\w', Name.Variable),
            (r'&[ \t]*\n[ \t]*', Operator),    # the next line goes on: its first word is no command
            (r'^[ \t]*[A-Za-z_]\w*', Keyword),
            (r'\b[vfc]_\w+(\[\d*\])*', Name.Variable),
            (r'[+-]?\d+(\.\d*)?([eE][+-]?\d+)?(?![\w.])', Number),
            (r'\w+', Text),
            (r'\s+', Text),
            (r'.', Text),
        ]
    }


def link_to_lammps(app, env, node, contnode):
    """:doc:`fix gravity <fix_gravity>` is a page of LAMMPS where there is none of ours."""
    target = node.get('reftarget', '')
    if node.get('reftype') != 'doc' or OURS.search(target) or not re.fullmatch(r'/?\w+', target):
        return None
    reference = nodes.reference('', '', internal=False, refuri=LAMMPS_MANUAL + target.lstrip('/') + '.html')
    reference += contnode
    return reference


def words(case):
    return ', '.join(f'{key} {value}' for key, value in case.items())


class BenchResults(Directive):
    """`.. bench-results::` shows every file of bench/results, as the benchmarks wrote it."""

    def run(self):
        env = self.state.document.settings.env
        folder = os.path.join(os.path.dirname(os.path.dirname(env.srcdir)), 'bench', 'results')
        files = sorted(f for f in os.listdir(folder) if f.endswith('.json')) if os.path.isdir(folder) else []
        if not files:
            return [nodes.paragraph(text='No result is on record yet.')]
        shown = []
        for name in files:
            path = os.path.join(folder, name)
            env.note_dependency(path)
            with open(path, encoding='utf-8') as f:
                report = json.load(f)
            section = nodes.paragraph()
            section += nodes.strong(text=name)
            section += nodes.Text(': ' + ', '.join(f'{key} {report[key]}' for key in ('machine', 'date', 'commit', 'command')
                                                   if report.get(key)))
            shown += [section, self.table(report.get('rows', []))]
        return shown

    @staticmethod
    def table(rows):
        def line(texts):
            row = nodes.row()
            for text in texts:
                entry = nodes.entry()
                entry += nodes.paragraph(text=text)
                row += entry
            return row

        group = nodes.tgroup(cols=4)
        for width in (50, 20, 15, 15):
            group += nodes.colspec(colwidth=width)
        head, body = nodes.thead(), nodes.tbody()
        head += line(('case', 'metric', 'value', 'unit'))
        for row in rows:
            value = row.get('value')
            text = f'{value:.4g}' if isinstance(value, (int, float)) else str(value)
            body += line((words(row.get('case', {})), str(row.get('metric', '')), text, str(row.get('unit', ''))))
        if not rows:
            body += line(('no rows', '', '', ''))
        group += head
        group += body
        table = nodes.table()
        table += group
        return table


def setup(app):
    app.add_lexer('LAMMPS', LammpsLexer)
    app.connect('missing-reference', link_to_lammps)
    app.add_directive('bench-results', BenchResults)
    return {'version': '1', 'parallel_read_safe': True, 'parallel_write_safe': True}

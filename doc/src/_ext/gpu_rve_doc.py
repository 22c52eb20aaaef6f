# SPDX-License-Identifier: GPL-2.0-only
"""What these pages need beyond Sphinx: the language LAMMPS, links to LAMMPS' own pages, the tables and figures of bench/results, and MathJax beside the pages."""

import glob
import os
import re
import shlex
import shutil
import sys

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.directives.patches import Figure
from pygments.lexer import RegexLexer
from pygments.token import Comment, Keyword, Name, Number, Operator, String, Text

REPOSITORY = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
sys.path.insert(0, os.path.join(REPOSITORY, 'tools'))
import bench_records

RESULTS = os.path.join(REPOSITORY, 'bench', 'results')

LAMMPS_MANUAL = 'https://docs.lammps.org/'

# Pages that are, or would be, ours: a reference to a missing one of these is a warning, not a link to LAMMPS.
OURS = re.compile(r'rve|mpm|rigid|random|footing|gpu|theory|accuracy|performance|architecture|install|units_notation|release_notes|failure|styles|stability'
                  r'|getting_started|howto|glossary|validation|verification|packing|contact_laws|loading_paths|troubleshooting|tutorial|study|dev_'
                  r'|python_reference|overview|platforms|limitations|environment|help')

# Debian's libjs-mathjax, and what formulas in TeX that are drawn as SVG need of it: 4 MB of 54
MATHJAX = '/usr/share/javascript/mathjax'
MATHJAX_PARTS = ('MathJax.js', 'config/TeX-AMS_SVG.js', 'jax/input/TeX', 'jax/element/mml', 'jax/output/SVG/jax.js', 'jax/output/SVG/config.js',
                 'jax/output/SVG/autoload', 'jax/output/SVG/fonts/TeX', 'extensions')


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


def cell(value):
    return f'{value:.4g}' if isinstance(value, float) else str(value)


def table_of(titles, widths, lines):
    """A docutils table of texts."""
    def row_of(texts):
        row = nodes.row()
        for text in texts:
            entry = nodes.entry()
            entry += nodes.paragraph(text=text)
            row += entry
        return row

    group = nodes.tgroup(cols=len(titles))
    for width in widths:
        group += nodes.colspec(colwidth=width)
    head, body = nodes.thead(), nodes.tbody()
    head += row_of(titles)
    for line in lines:
        body += row_of(line)
    group += head
    group += body
    table = nodes.table()
    table += group
    return table


class BenchResults(Directive):
    """`.. bench-results:: [files]` shows results as the benchmarks wrote them: all rows of bench/results/<files>.json, or

        :where:   key=value ...   those rows that have these values, of the row itself, its case, or its details; `a|b` is either, nothing
                                  stands for a key that the row has not, and values with spaces are in quotes
        :columns: key ...         only these columns of them
        :metrics: metric ...      a line for each case instead of each row, with the columns and these of its metrics
        :millions: column ...     these columns and metrics are shown in millions
    """
    optional_arguments = 1
    option_spec = {'where': shlex.split, 'columns': str.split, 'metrics': str.split, 'millions': str.split}

    def run(self):
        env = self.state.document.settings.env
        pattern = (self.arguments[0] if self.arguments else '*') + '.json'
        shown = []
        for path in sorted(glob.glob(os.path.join(RESULTS, pattern))):
            env.note_dependency(path)
            report = bench_records.read(path)
            rows = [row for row in report['rows'] if self.is_wanted(row)]
            if rows:
                shown += [self.heading(os.path.basename(path), report), self.table(rows)]
        return shown or [nodes.paragraph(text='No result is on record yet.')]

    @staticmethod
    def look_up(row, key):
        return next((part[key] for part in (row, row.get('case', {}), row.get('details') or {}) if key in part), '')

    def is_wanted(self, row):
        conditions = (word.split('=', 1) for word in self.options.get('where', []))
        return all(str(self.look_up(row, key)) in value.split('|') for key, value in conditions)

    @staticmethod
    def heading(name, report):
        section = nodes.paragraph()
        section += nodes.strong(text=name)
        section += nodes.Text(': ' + ', '.join(f'{key} {report[key]}' for key in ('machine', 'date', 'commit', 'command')
                                               if report.get(key)))
        return section

    def table(self, rows):
        columns = self.options.get('columns')
        metrics = self.options.get('metrics')
        millions = self.options.get('millions', [])

        def title(key):
            return key.replace('_', ' ') + (' [10^6]' if key in millions else '')

        def shown(key, value):
            return cell(float(f'{value * 1e-6:.3g}') if key in millions and value != '' else value)

        if metrics:
            cases = {}
            for row in rows:
                cases.setdefault(words(row['case']), []).append(row)
            lines = []
            for of_case in cases.values():
                values = {row['metric']: row['value'] for row in of_case}
                if values.keys() & set(metrics):
                    lines.append([shown(key, self.look_up(of_case[0], key)) for key in columns or ()]
                                 + [shown(metric, values.get(metric, '')) for metric in metrics])
            titles = [title(key) for key in (columns or []) + metrics]
            return table_of(titles, [10] * len(titles), lines)
        if columns:
            return table_of([title(key) for key in columns], [10] * len(columns),
                            [[shown(key, self.look_up(row, key)) for key in columns] for row in rows])
        return table_of(('case', 'metric', 'value', 'unit'), (50, 20, 15, 15),
                        [(words(row.get('case', {})), str(row.get('metric', '')), cell(row.get('value')), str(row.get('unit', '')))
                         for row in rows])


class StabilityEnvelope(Directive):
    """`.. stability-envelope:: file` is the table of bench/results/<file>.json, as extremes_report writes it: what must hold, and where it
    does in each number format."""
    required_arguments = 1
    FORMATS = ('fast', 'mixed', 'double')
    VERDICTS = (('holds', ''), ('warned', 'warned of: '), ('status', 'status: '), ('silent', 'WRONG: '))

    def run(self):
        env = self.state.document.settings.env
        path = os.path.join(RESULTS, self.arguments[0] + '.json')
        env.note_dependency(path)
        if not os.path.exists(path):
            return [nodes.paragraph(text='No result is on record yet.')]
        report = bench_records.read(path)
        rows = [row for row in report['rows'] if row['metric'] == 'envelope']
        items = {}
        for row in rows:
            items.setdefault(row['case']['item'], {})[row['case']['format']] = row
        lines = [[f"{item}: {formats['mixed']['case']['quantity']}", formats['mixed']['details']['property']]
                 + [self.words(formats[name]['details']) for name in self.FORMATS] for item, formats in items.items()]
        return [BenchResults.heading(os.path.basename(path), report),
                table_of(('extreme', 'what must hold') + self.FORMATS, (18, 34, 16, 16, 16), lines)]

    def words(self, details):
        parts = [prefix + details[verdict] for verdict, prefix in self.VERDICTS if details[verdict]]
        if details['holds']:
            parts[0] += f" (within {details['limit']:g})"
        return '; '.join(parts)


class BenchFigure(Figure):
    """`.. bench-figure:: file` is a figure that is drawn from results, by bench/plot_bench.py or what its caption says; while there is none, a line says so."""

    def run(self):
        env = self.state.document.settings.env
        path = os.path.join(env.srcdir, self.arguments[0])
        env.note_dependency(path)
        if os.path.exists(path):
            return super().run()
        return [nodes.paragraph(text=f'{os.path.basename(path)} has not been drawn yet.')]


def copy_mathjax(app, exception):
    """After the pages, what they load for formulas."""
    if exception or app.builder.format != 'html' or not os.path.exists(os.path.join(MATHJAX, 'MathJax.js')):
        return
    for part in MATHJAX_PARTS:
        source, target = os.path.join(MATHJAX, part), os.path.join(app.outdir, '_static', 'mathjax', part)
        if os.path.isdir(source):
            shutil.copytree(source, target, dirs_exist_ok=True)
        elif os.path.exists(source):
            os.makedirs(os.path.dirname(target), exist_ok=True)
            shutil.copy(source, target)


def setup(app):
    app.add_lexer('LAMMPS', LammpsLexer)
    app.connect('missing-reference', link_to_lammps)
    app.connect('build-finished', copy_mathjax)
    app.add_directive('bench-results', BenchResults)
    app.add_directive('stability-envelope', StabilityEnvelope)
    app.add_directive('bench-figure', BenchFigure)
    return {'version': '1', 'parallel_read_safe': True, 'parallel_write_safe': True}

# SPDX-License-Identifier: GPL-2.0-only
# Sphinx (5.3 of Debian 12 or newer) builds these pages offline and without warnings:
#
#   sphinx-build -W -b html doc/src build/doc

import importlib.util
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), '_ext'))
import gpu_rve_doc

# python_reference documents the package gpu_rve from its sources: neither the compiled library nor numpy is needed.
sys.path.insert(0, os.path.join(gpu_rve_doc.REPOSITORY, 'python'))
autodoc_mock_imports = ['cffi', 'matplotlib', 'numpy', 'gpu_rve._library']
autodoc_member_order = 'bysource'
autodoc_typehints = 'none'

project = 'GPU_RVE'
author = 'the GPU_RVE authors'
copyright = 'the GPU_RVE authors; GNU General Public License, version 2'
release = version = '0.1.0'

extensions = ['sphinx.ext.autodoc', 'sphinx.ext.mathjax', 'gpu_rve_doc', 'notebook']
source_suffix = '.rst'
exclude_patterns = ['_ext']
highlight_language = 'none'
html_static_path = ['_static']
html_css_files = ['gpu_rve.css']
# MathJax 2 of Debian's libjs-mathjax, copied into the pages (gpu_rve_doc), so that they need no network; without that package MathJax comes from its server.
if os.path.exists(os.path.join(gpu_rve_doc.MATHJAX, 'MathJax.js')):
    mathjax_path = 'mathjax/MathJax.js?config=TeX-AMS_SVG'
    mathjax2_config = {'tex2jax': {'inlineMath': [['\\(', '\\)']], 'processEscapes': True, 'ignoreClass': 'document', 'processClass': 'math'}, 'showMathMenu': False}
numfig = True
math_eqref_format = '[{number}]'    # numbers in parentheses are the paper's

if importlib.util.find_spec('sphinx_rtd_theme'):
    html_theme = 'sphinx_rtd_theme'
    html_theme_options = {'navigation_depth': 2}
    extensions.append('sphinx_rtd_theme')
else:
    html_theme = 'alabaster'
html_title = 'GPU_RVE'
html_show_sourcelink = False

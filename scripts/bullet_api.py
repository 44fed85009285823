#!/usr/bin/env python3
# SPDX-License-Identifier: Zlib
# SPDX-FileCopyrightText: 2026 The btgpu authors
"""The public interface of Bullet's rigid body world, from the installed headers, and docs/compatibility_api.md.

  scripts/bullet_api.py list     one row a line: the methods, data, flags and globals that the headers declare
  scripts/bullet_api.py check    fails if a row is missing in the document, is there twice or is no longer in the headers;
                                 if it says nothing of where it runs; if its test does not exist, does not name it, or
                                 does not step where the row says

The compiler ($CXX, else c++) preprocesses the headers, so that conditions and macros are what an application sees; the
declarations are read here. A method's row has the types of its parameters, for overloads.
"""
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
DOCUMENT = ROOT / 'docs' / 'compatibility_api.md'

# Headers an application includes for the world and its parts.
HEADERS = ['btBulletDynamicsCommon.h', 'BulletCollision/CollisionDispatch/btGhostObject.h',
           'BulletCollision/CollisionDispatch/btCompoundCompoundCollisionAlgorithm.h',
           'BulletCollision/CollisionDispatch/btSimulationIslandManager.h',
           'BulletDynamics/ConstraintSolver/btContactConstraint.h']
# Classes whose public methods and data get rows, besides the constraints: what derives from btTypedConstraint is found.
CLASSES = ['btCollisionWorld', 'btDynamicsWorld', 'btDiscreteDynamicsWorld', 'btCollisionObject', 'btRigidBody',
           'btContactSolverInfoData', 'btDispatcherInfo', 'btSimulationIslandManager', 'btJointFeedback',
           'btConstraintSetting', 'btRotationalLimitMotor', 'btTranslationalLimitMotor', 'btRotationalLimitMotor2',
           'btTranslationalLimitMotor2', 'btGhostObject', 'btPairCachingGhostObject']
WORLD = ['btCollisionWorld', 'btDynamicsWorld', 'btDiscreteDynamicsWorld']  # a world and its bases
BASE_OF_CONSTRAINTS = 'btTypedConstraint'
# Enumerations get rows where one of these files, or the header of one of the classes, defines them.
ENUM_HEADERS = ['btContactSolverInfo.h', 'btIDebugDraw.h', 'btBroadphaseProxy.h', 'btManifoldPoint.h',
                'btCollisionDispatcher.h', 'btDispatcher.h']
# Macros that are flags: activation states.
MACROS = {'btCollisionObject.h': r'#define\s+([A-Z][A-Z_]+)\s+(\d+)\s*$'}
# Sizes and ends of enumerations, which no application passes; types of shapes.
NOT_FLAGS = re.compile(r'^(MAX_CONSTRAINT_TYPE|DBG_MAX_DEBUG_DRAW_MODE|.*_SHAPE_PROXYTYPE|.*_PROXYTYPE|CONCAVE_SHAPES_START_HERE|'
                       r'CONCAVE_SHAPES_END_HERE|IMPLICIT_CONVEX_SHAPES_START_HERE|MAX_BROADPHASE_COLLISION_TYPES)$')
# Where a row may run; each with the kinds of tests (API_CASE's third argument) that can show it.
PLACES = {'device': {'OnDevice', 'Shares'}, 'CPU in the step': {'Shares'}, 'stock path': {'StockPath'},
          'btgpu': {'OnDevice', 'Shares'}, 'Bullet': None, 'no effect': None}


def preprocessed():
    flags = subprocess.run(['pkg-config', '--cflags', 'bullet'], check=True, capture_output=True, text=True).stdout
    source = ''.join(f'#include <{h}>\n' for h in HEADERS)
    compiler = os.environ.get('CXX', 'c++').split()
    return subprocess.run([*compiler, '-E', '-dD', '-x', 'c++', '-std=c++17', *flags.split(), '-'], check=True,
                          input=source, capture_output=True, text=True).stdout


class Token(str):
    """A token, and the header it comes from."""
    header = ''


def tokens_and_macros(text):
    tokens, macros, header = [], [], ''
    token = re.compile(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_]\w*|\d[\w.]*|::|->|<<|[^\s\w]')
    for line in text.splitlines():
        marker = re.match(r'# \d+ "([^"]*)"', line)
        if marker:
            header = marker.group(1).rsplit('/', 1)[-1]
        elif line.startswith('#'):
            if header in MACROS and re.match(MACROS[header], line):
                macros.append(re.match(MACROS[header], line).group(1))
        elif header.startswith('bt'):
            for match in token.finditer(line):
                tokens.append(Token(match.group()))
                tokens[-1].header = header
    return tokens, macros


def end_of(tokens, i):
    """The index after the bracket that closes the one at i."""
    depth = 0
    while True:
        depth += tokens[i] in '([{' and len(tokens[i]) == 1
        depth -= tokens[i] in ')]}' and len(tokens[i]) == 1
        i += 1
        if depth == 0:
            return i


def without_attributes(tokens):
    kept, i = [], 0
    while i < len(tokens):
        if tokens[i] == '__attribute__':
            i = end_of(tokens, i + 1)
        else:
            kept.append(tokens[i])
            i += 1
    return kept


def spelled(tokens):
    text = ' '.join(tokens)
    text = re.sub(r'\s*(::)\s*', r'\1', text)
    text = re.sub(r'\s+([*&])', r'\1', text)
    return re.sub(r'\b(class|struct) ', '', text)


def parameter_type(tokens):
    """Of one parameter: its type, without name and default."""
    if '=' in tokens:
        tokens = tokens[:tokens.index('=')]
    if len(tokens) > 1 and re.match(r'[A-Za-z_]', tokens[-1]) and tokens[-1] not in (
            'int', 'float', 'bool', 'char', 'void', 'const', 'unsigned') and tokens[-2] not in ('const', '::'):
        tokens = tokens[:-1]
    elif len(tokens) == 3 and tokens[0] == 'const' and tokens[-1] not in ('int', 'bool'):
        tokens = tokens[:-1]
    return spelled(tokens)


def parameters(tokens):
    parts, part, depth = [], [], 0
    for t in tokens:
        depth += (t in ('(', '<')) - (t in (')', '>'))
        if t == ',' and depth == 0:
            parts.append(part)
            part = []
        else:
            part.append(t)
    if part and part != ['void']:
        parts.append(part)
    return ', '.join(parameter_type(p) for p in parts)


class Class:
    def __init__(self, name, bases, header):
        self.name, self.bases, self.header = name, bases, header
        self.rows = []


class Enum:
    def __init__(self, name, header, names):
        self.name, self.header, self.names = name, header, names


class Reader:
    def __init__(self, tokens):
        self.classes, self.enums, self.globals = {}, [], []
        self.read(without_attributes(tokens), None, 'public')

    def read(self, tokens, inside, access):
        """The declarations of a scope: of the class `inside`, or of none."""
        i = 0
        while i < len(tokens):
            t = tokens[i]
            if t in ('public', 'protected', 'private') and i + 1 < len(tokens) and tokens[i + 1] == ':':
                access, i = t, i + 2
                continue
            if t in (';', '}'):
                i += 1
                continue
            if t in ('namespace', 'extern') and '{' in tokens[i:i + 3]:
                opened = tokens.index('{', i, i + 3)
                i = opened + 1
                continue
            start = i
            while tokens[i] not in (';', '{'):  # to the end of the declaration, or to its body
                i = end_of(tokens, i) if tokens[i] in ('(', '[') else i + 1
            head = tokens[start:i]
            body = []
            if tokens[i] == '{':
                end = end_of(tokens, i)
                body, i = tokens[i + 1:end - 1], end
            self.declaration(head, body, inside, access)
            # `struct X {...} name;`, `enum {...};`
            if body and i < len(tokens) and tokens[i] == ';':
                i += 1

    def declaration(self, head, body, inside, access):
        if not head or head[0] in ('template', 'friend', 'typedef', 'using'):
            return
        if head[0] == 'enum':
            self.enum(head, body, inside)
        elif head[0] in ('class', 'struct', 'union') and (body or len(head) == 2) and '(' not in head:
            self.a_class(head, body, inside)
        elif inside is None:
            if head[0] == 'extern' and re.match(r'g[A-Z]', head[-1]):
                self.globals.append(str(head[-1]))
        elif access == 'public':
            self.member(head, inside)

    def enum(self, head, body, inside):
        names, expected = [], True
        for t in body:
            if expected and re.match(r'[A-Za-z_]', t):
                names.append(str(t))
                expected = False
            expected = expected or t == ','
        scope = inside.name + '::' if inside else ''
        self.enums.append(Enum(scope + (head[1] if len(head) > 1 else ''), head[0].header, names))

    def a_class(self, head, body, inside):
        if not body or head[0] == 'union':
            return
        name = (inside.name + '::' if inside else '') + head[1]
        bases = [str(t) for t in head[2:] if t not in (':', ',', 'public', 'virtual', 'protected', 'private')]
        made = self.classes[name] = Class(name, bases, head[0].header)
        self.read(body, made, 'private' if head[0] == 'class' else 'public')

    def member(self, head, inside):
        if '(' not in head:
            self.data(head, inside)
            return
        opened = head.index('(')
        name = head[opened - 1]
        if 'operator' in head[:opened] or head[opened - 2:opened - 1] == ['~']:
            return
        closed = end_of(head, opened)
        row = f'{inside.name}::{name}({parameters(head[opened + 1:closed - 1])})'
        if row not in inside.rows:  # const or not
            inside.rows.append(row)

    def data(self, head, inside):
        if head[-1] == 'static' or len(head) < 2:
            return
        depth, last = 0, None  # names of `type a, b[3]`
        for t in [*head, ',']:
            if t == ',' and depth == 0:
                inside.rows.append(f'{inside.name}::{last}')
            depth += (t in ('[', '<')) - (t in (']', '>'))
            if depth == 0 and re.match(r'[A-Za-z_]', t):
                last = t


def sections():
    """[(title, [row])] of what the headers declare."""
    tokens, macros = tokens_and_macros(preprocessed())
    reader = Reader(tokens)

    def is_constraint(c):
        return c.name == BASE_OF_CONSTRAINTS or any(is_constraint(reader.classes[b]) for b in c.bases if b in reader.classes)

    def overridden(name):
        """Of the world's bases: what btDiscreteDynamicsWorld has a method of its own for, which is what is called."""
        later = WORLD[WORLD.index(name) + 1:] if name in WORLD else []
        return {row.split('::', 1)[1] for n in later for row in reader.classes[n].rows}

    missing = [name for name in CLASSES if name not in reader.classes]
    if missing:
        sys.exit(f'bullet_api: not found in the headers: {", ".join(missing)}')
    wanted = CLASSES + [c.name for c in reader.classes.values() if is_constraint(c)]
    result, headers = [], set(ENUM_HEADERS)
    for name in wanted:
        headers.add(reader.classes[name].header)
        rows = [row for c in reader.classes.values() if c.name == name or c.name.startswith(name + '::') for row in c.rows]
        result.append((name, [r for r in rows if r.split('::', 1)[1] not in overridden(name)]))
    for e in reader.enums:
        names = [n for n in e.names if not NOT_FLAGS.match(n)]
        if e.header in headers and names:
            result.append((e.name or e.header, names))
    result.append(('activation states', macros))
    result.append(('globals', sorted(set(reader.globals))))
    return result



# ---- the cases of tests/compat/api, and the document

CASES = ROOT / 'tests' / 'compat' / 'api'


def cases():
    """{'Suite.Name': (kind of place, text of the case and of all functions and classes of the folder that it uses)}"""
    text = '\n'.join(p.read_text() for p in sorted(CASES.glob('*.h')) + sorted(CASES.glob('*.cpp')))
    found, helpers = {}, {}
    # Definitions at the left margin, up to the bracket that closes them there.
    for match in re.finditer(r'^(?!#|//|namespace|\s|\})((?:[^\n;{}]*\n){0,2}[^\n;]*\{\n(?:.*\n)*?\}.*)$', text, re.M):
        body = match.group(1)
        case = re.match(r'API_CASE\((\w+), (\w+), (\w+)\(', body)
        if case:
            found[f'{case.group(1)}.{case.group(2)}'] = (case.group(3), body)
        else:
            head = body.split('{', 1)[0]
            name = re.search(r'(\w+)\s*\(', head) or re.search(r'(?:struct|class)\s+(\w+)', head)
            if name:
                helpers.setdefault(name.group(1), []).append(body)

    def with_helpers(body):
        seen, todo = set(), [body]
        parts = []
        while todo:
            part = todo.pop()
            parts.append(part)
            for word in set(re.findall(r'\w+', part)) & (helpers.keys() - seen):
                seen.add(word)
                todo += helpers[word]
        return '\n'.join(parts)

    return {name: (kind, with_helpers(body)) for name, (kind, body) in found.items()}


def identifier(row):
    return row.split('(')[0].split('::')[-1]


def rows_of_document():
    """[(row, place, test)]"""
    rows = []
    for line in DOCUMENT.read_text().splitlines():
        match = re.match(r'\| `([^`]+)` \| ([^|]*) \| ([^|]*) \|$', line)
        if match:
            rows.append((match.group(1), match.group(2).strip(), match.group(3).strip()))
    return rows


def check():
    errors, known = [], cases()
    declared = [row for _, rows in sections() for row in rows]
    listed = rows_of_document()
    names = [row for row, _, _ in listed]
    errors += [f'{row}: in the headers, but no row' for row in declared if row not in set(names)]
    errors += [f'{row}: a row, but no longer in the headers' for row in names if row not in set(declared)]
    errors += [f'{row}: {names.count(row)} rows' for row in sorted(set(names)) if names.count(row) > 1]
    for row, place, test in listed:
        if place not in PLACES:
            errors.append(f'{row}: "{place}" is no place; {", ".join(PLACES)} are')
        if not test:
            errors.append(f'{row}: no test')
        elif test not in known:
            errors.append(f'{row}: no test {test} in tests/compat/api')
        else:
            kind, text = known[test]
            if not re.search(rf'\b{identifier(row)}\b', text):
                errors.append(f'{row}: {test} does not name {identifier(row)}')
            if PLACES.get(place) and kind not in PLACES[place]:
                errors.append(f'{row}: "{place}", but {test} steps as {kind} says')
    print('\n'.join(errors) if errors else f'{len(listed)} rows, {len({t for _, _, t in listed})} tests')
    return 1 if errors else 0


def main():
    command = sys.argv[1] if len(sys.argv) == 2 else ''
    if command == 'check':
        sys.exit(check())
    if command != 'list':
        sys.exit(__doc__)
    for title, rows in sections():
        print(f'## {title}')
        for row in rows:
            print(row)


if __name__ == '__main__':
    main()

"""Makes shared libraries of functions that numba has compiled; importing it imports numba.

A library has what `library.py` calls, the code of all functions that this needs, and two functions of numba's runtime,
which count references to arrays that compiled code makes for itself.
"""

from __future__ import annotations

import subprocess
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from llvmlite import binding
from numba import types
from numba.core.codegen import get_host_cpu_features
from numba.core.runtime.nrtdynmod import _meminfo_struct_type
from numba.np.numpy_support import as_dtype

from rbxcompose.base.files import replace_file
from rbxcompose.domains.arms.motion.library import ENTRY, FAILED, KINDS, OTHER, REAL, WHOLE, array_kind

Numba = Any  # its types and code
_RUNTIME = """
declare ptr @malloc(i64)
declare void @free(ptr)
define ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %wide = zext i32 %align to i64
  %before = add i64 %wide, 40
  %all = add i64 %size, %before
  %info = call ptr @malloc(i64 %all)
  %none = icmp eq ptr %info, null
  br i1 %none, label %done, label %made
made:
  %address = ptrtoint ptr %info to i64
  %behind = add i64 %address, %before
  %rest = urem i64 %behind, %wide
  %data = sub i64 %behind, %rest
  %place = inttoptr i64 %data to ptr
  store { i64, ptr, ptr, ptr, i64 } { i64 1, ptr null, ptr null, ptr null, i64 0 }, ptr %info
  %where = getelementptr { i64, ptr, ptr, ptr, i64 }, ptr %info, i32 0, i32 3
  store ptr %place, ptr %where
  br label %done
done:
  ret ptr %info
}
define void @NRT_MemInfo_call_dtor(ptr %info) {
  call void @free(ptr %info)
  ret void
}
"""
"""Memory with a count of references in front of it [40 B]."""
_COUNTED = "{i64, i8*, i8*, i8*, i64}"
"""How numba lays that out."""


def write_library(dispatcher: Numba, path: Path) -> None:
    """Write a function as a library, unless what it takes or returns cannot be passed, or the linker fails."""
    if str(_meminfo_struct_type) != _COUNTED:
        return
    for made in dispatcher.overloads.values():
        kinds = "".join(map(_kinds, made.signature.args))
        if OTHER not in kinds and made.signature.return_type == types.int64:
            with suppress(OSError, subprocess.CalledProcessError):
                _link(_object(made, kinds), path)


def _kinds(type_: Numba) -> str:
    """Return the kinds of the numbers that a value consists of, as `flat` does."""
    if isinstance(type_, types.BaseTuple):
        return "".join(map(_kinds, type_.types))  # type: ignore[attr-defined]
    if isinstance(type_, types.Array):
        return array_kind(as_dtype(type_.dtype), type_.ndim) if type_.layout == "C" and type_.aligned else OTHER
    return {types.int64: WHOLE, types.float64: REAL}.get(type_, OTHER)


def _object(made: Numba, kinds: str) -> bytes:
    """Return machine code of a function and all that it calls."""
    module = made.library._get_module_for_linking().clone()
    entry = binding.parse_assembly(_entry(module.get_function(made.fndesc.llvm_func_name), kinds) + _RUNTIME)
    entry.triple, entry.data_layout = module.triple, module.data_layout
    module.link_in(entry)
    features = get_host_cpu_features()  # type: ignore[no-untyped-call]
    target = binding.Target.from_triple(module.triple)
    machine = target.create_target_machine(binding.get_host_cpu_name(), features, opt=3, reloc="pic")
    passes = binding.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()  # what Python would call
    passes.run(module, binding.create_pass_builder(machine, binding.create_pipeline_tuning_options()))
    code: bytes = machine.emit_object(module)
    return code


def _entry(function: Numba, kinds: str) -> str:
    """Return the code of a function that takes a block, calls another one, and returns its answer."""
    _, _, *taken = (str(argument.type) for argument in function.arguments)  # after places for the answer and an error
    lines = []
    for index, type_ in enumerate(taken):
        lines.append(f"%p{index} = getelementptr i64, ptr %block, i64 {index}")
        lines.append(f"%a{index} = load {type_}, ptr %p{index}")
    given = "".join(f", {type_} %a{index}" for index, type_ in enumerate(taken))
    return f"""
@{KINDS} = constant [{len(kinds) + 1} x i8] c"{kinds}\\00"
declare i32 @"{function.name}"(ptr, ptr{"".join(f", {type_}" for type_ in taken)})
define i64 @{ENTRY}(ptr %block) {{
  %answer = alloca i64
  %error = alloca ptr
  {chr(10).join(lines)}
  %status = call i32 @"{function.name}"(ptr %answer, ptr %error{given})
  %found = load i64, ptr %answer
  %good = icmp eq i32 %status, 0
  %result = select i1 %good, i64 %found, i64 {FAILED}
  ret i64 %result
}}
"""


def _link(code: bytes, path: Path) -> None:
    with TemporaryDirectory() as folder:
        source, made = Path(folder, "code.o"), Path(folder, "code.so")
        source.write_bytes(code)
        words = ["ld", "-shared", "-z", "noexecstack", "-o", str(made), str(source)]
        subprocess.run(words, check=True, capture_output=True)
        replace_file(path, made.read_bytes(), mode=0o600)

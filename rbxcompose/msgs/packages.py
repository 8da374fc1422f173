"""Interface texts for export: one with all messages inside it, as in MCAP, or a package for a ROS 2 workspace."""

from collections.abc import Callable, Iterable

from rbxcompose.msgs.definitions import INTERFACES, KINDS, FieldType, interface_names, parse
from rbxcompose.msgs.registry import chosen, text_of

OWN = "rbxcompose_msgs"
"""The package that no ROS 2 installation has."""

_SEPARATOR = "=" * 80
_XML = """<?xml version="1.0"?>
<package format="3">
  <name>{package}</name>
  <version>{version}</version>
  <description>Messages, services and actions of rbxcompose.</description>
  <maintainer email="rbxcompose@example.org">rbxcompose</maintainer>
  <license>{licence}</license>
  <buildtool_depend>ament_cmake</buildtool_depend>
  <buildtool_depend>rosidl_default_generators</buildtool_depend>
{depends}  <exec_depend>rosidl_default_runtime</exec_depend>
  <member_of_group>rosidl_interface_packages</member_of_group>
  <export>
    <build_type>ament_cmake</build_type>
  </export>
</package>
"""
_CMAKE = """cmake_minimum_required(VERSION 3.8)
project({package})
find_package(ament_cmake REQUIRED)
find_package(rosidl_default_generators REQUIRED)
{finds}rosidl_generate_interfaces(${{PROJECT_NAME}}
{files})
ament_export_dependencies(rosidl_default_runtime)
ament_package()
"""


def all_names() -> list[str]:
    """Return the sorted names of all interfaces that have a text."""
    return sorted({*chosen().texts, *(name for kind in KINDS for name in interface_names(kind))})


def own_packages() -> list[str]:
    """Return the packages of a robot's own types that are no standard ones."""
    return sorted({name.split("/")[0] for name in chosen().texts} - {path.name for path in INTERFACES.iterdir()})


def parts_of(name: str) -> list[str]:
    """Return the names of all messages inside an interface, each once, containers first."""
    return parts(name, lambda one: [field.type for each in parse(one, text_of(one)) for field in each.fields])


def whole_text(name: str) -> str:
    """Return the text of an interface and those of all messages inside it, each below a line of `=`."""
    return joined(name, parts_of(name), text_of)


def package_files(package: str, version: str, licence: str) -> dict[str, str]:
    """Return the files of a ROS 2 package with all interfaces of `package`, by their paths below its folder."""
    names = [name for name in all_names() if name.startswith(f"{package}/")]
    texts = {name.partition("/")[2] + "." + name.split("/")[1]: text_of(name) for name in names}
    used = {part.split("/")[0] for name in names for part in parts_of(name)} - {package}
    depends = used | ({"action_msgs"} if any("/action/" in name for name in names) else set())
    lines = [f'  "{path}"\n' for path in texts]
    lines += [f"  DEPENDENCIES {' '.join(sorted(used))}\n"] if used else []
    finds = "".join(f"find_package({text} REQUIRED)\n" for text in sorted(used))
    tags = "".join(f"  <depend>{text}</depend>\n" for text in sorted(depends))
    return {
        **texts,
        "package.xml": _XML.format(package=package, version=version, licence=licence, depends=tags),
        "CMakeLists.txt": _CMAKE.format(package=package, finds=finds, files="".join(lines)),
    }


def parts(name: str, types_of: Callable[[str], Iterable[FieldType]]) -> list[str]:
    """Return the names of all messages inside an interface, each once, containers first.

    `types_of` maps the name of an interface to the types of its fields.
    """
    found: dict[str, None] = {}
    left = [name]
    while left:
        fresh = dict.fromkeys(type_.base for type_ in types_of(left.pop(0)) if type_.is_message)
        new = [base for base in fresh if base not in found]
        found.update(dict.fromkeys(new))
        left += new
    return list(found)


def joined(name: str, made_of: Iterable[str], text_of: Callable[[str], str]) -> str:
    """Return the text of an interface and those of all messages inside it, each below a line of `=`."""
    texts = [f"{_SEPARATOR}\nMSG: {short(text)}\n{text_of(text)}" for text in made_of]
    return "".join([text_of(name), *texts])


def short(name: str) -> str:
    """Return `geometry_msgs/Twist` for `geometry_msgs/msg/Twist`."""
    package, _, bare = name.split("/")
    return f"{package}/{bare}"

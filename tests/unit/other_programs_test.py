"""Reads what heddle writes with VTK, Gmsh, meshio and CalculiX: other_programs_test.py HEDDLE CASE

A case is woven for two picks. It is relaxed from its weaving matrix, its yarns' surfaces are made and its cell is meshed: each program must find the
elements and volumes that heddle reports; what is not installed is skipped.
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree

from vtkmodules.vtkCommonDataModel import VTK_POLY_LINE
from vtkmodules.vtkFiltersCore import vtkMassProperties
from vtkmodules.vtkIOHDF import vtkHDFReader
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

try:
    import meshio
except ImportError:
    meshio = None
GMSH = shutil.which("gmsh")
CCX = shutil.which("ccx")
HEDDLE, CASE = sys.argv[1:3]
FIBERS = 3
VOXELS = (9, 8, 4)
ELEMENTS = 9 * 8 * 4
POINTS = 10 * 9 * 5


def gmsh(folder, *lines):
    """What Gmsh says of a script's commands."""
    script = folder / "script.geo"
    script.write_text("\n".join(lines))
    run = subprocess.run([GMSH, script, "-parse_and_exit", "-v", "5"], capture_output=True, text=True, timeout=120, check=True)
    return run.stdout + run.stderr


def enclosed_volume(points, triangles):
    """By the divergence theorem, with the origin at a point of the surface."""
    a, b, c = ([points[t[i]] - points[triangles[0][0]] for t in triangles] for i in range(3))
    return sum(x @ [y[1] * z[2] - y[2] * z[1], y[2] * z[0] - y[0] * z[2], y[0] * z[1] - y[1] * z[0]] for x, y, z in zip(a, b, c)) / 6


def name_of(yarn):
    return f"{'weft' if yarn['weft'] else 'warp'}_{yarn['yarn']}"


def read_by_vtk(reader, file):
    reader.SetFileName(str(file))
    reader.Update()
    return reader.GetOutput()


class WovenInVtk(unittest.TestCase):
    """The first two picks of the case with single fibers: the loom, its unit cell, and the series of picks."""

    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        cls.folder = pathlib.Path(cls.temporary.name)
        subprocess.run([HEDDLE, "weave", CASE, "--picks", "2", "--set", "yarns.km2_600.fibers=1", "--quiet", "--output", cls.folder], check=True,
                       stdout=subprocess.DEVNULL)

    def fibers_in(self, file):
        grid = read_by_vtk(vtkHDFReader(), file)
        self.assertTrue(all(grid.GetCellType(i) == VTK_POLY_LINE for i in range(grid.GetNumberOfCells())))
        for name in ("tension_N", "stress_Pa", "radius_m"):
            self.assertEqual(grid.GetPointData().GetArray(name).GetNumberOfTuples(), grid.GetNumberOfPoints())
        return grid

    def test_series_of_picks(self):
        series = json.loads((self.folder / "picks.vtkhdf.series").read_text())
        self.assertEqual([f["time"] for f in series["files"]], [1, 2])
        for entry in series["files"]:
            grid = self.fibers_in(self.folder / entry["name"])
            self.assertEqual(grid.GetFieldData().GetArray("picks").GetTuple1(0), entry["time"])
            self.assertEqual(grid.GetNumberOfCells(), 2 + entry["time"])  # two warps, and a weft a pick

    def test_loom(self):
        grid, last = self.fibers_in(self.folder / "weave.vtkhdf"), self.fibers_in(self.folder / "picks" / "pick_0002.vtkhdf")
        self.assertEqual(grid.GetNumberOfCells(), 4)
        self.assertEqual(grid.GetPoint(0), last.GetPoint(0))


class OtherPrograms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.temporary.cleanup)
        folder = pathlib.Path(cls.temporary.name)

        def heddle(*arguments):
            subprocess.run([HEDDLE, *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)

        cls.relax, cls.envelope, cls.mesh = folder / "relax", folder / "envelope", folder / "mesh"
        heddle("relax", CASE, "--start-fibers", FIBERS, "--quiet", "--output", cls.relax)
        heddle("envelope", cls.relax, "--formats", "stl,obj,ply,off,vtp,tg3", "--output", cls.envelope)
        heddle("mesh", cls.envelope, "--voxels", *VOXELS, "--output", cls.mesh)
        cls.tetrahedra = folder / "tetrahedra"
        heddle("mesh", cls.envelope, "--tetrahedra", "--quadratic", "--output", cls.tetrahedra)
        cls.surfaces = json.loads((cls.envelope / "summary.json").read_text())
        cls.volume = 1
        for length in json.loads((cls.mesh / "summary.json").read_text())["cell_m"]:
            cls.volume *= length

    @unittest.skipUnless(GMSH, "Gmsh is not installed")
    def test_gmsh_reads_the_mesh(self):
        said = gmsh(self.mesh, 'Merge "mesh.msh";', "Plugin(MeshVolume).Run;")
        self.assertNotRegex(said, "Warning|Error")
        self.assertIn(f"{POINTS} nodes", said)
        self.assertIn(f"{ELEMENTS} elements", said)
        volume = float(re.search(r"Mesh volume .*: (\S+)", said).group(1))
        self.assertAlmostEqual(volume / self.volume, 1, delta=1e-4)  # Gmsh prints six digits

    @unittest.skipUnless(GMSH, "Gmsh is not installed")
    def test_gmsh_fills_the_surfaces(self):
        for yarn in self.surfaces["by_yarn"]:
            said = gmsh(self.envelope, f'Merge "{name_of(yarn)}.stl";', "CreateTopology;", "Surface Loop(1) = Surface{:};", "Volume(1) = {1};", "Mesh 3;",
                        "Plugin(MeshVolume).Run;")
            self.assertNotRegex(said, "Warning|Error")
            self.assertIn(f"{yarn['triangles']} facets", said)
            volume = float(re.search(r"Mesh volume .*: (\S+)", said).group(1))  # of the tetrahedra within
            self.assertAlmostEqual(volume / yarn["volume_m3"], 1, delta=1e-4)  # six digits, and coordinates in single precision

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_meshio_reads_the_mesh(self):
        for name, extra in (("mesh.msh", 0), ("mesh.vtu", 0), ("abaqus.inp", 2), ("calculix.inp", 2)):  # two nodes hold the macroscopic strains
            read = meshio.read(self.mesh / name)
            with self.subTest(name):
                self.assertEqual(len(read.points), POINTS + extra)
                self.assertEqual({block.type for block in read.cells}, {"hexahedron"})
                self.assertEqual(sum(len(block.data) for block in read.cells), ELEMENTS)
                size = read.points[:POINTS].max(axis=0) - read.points[:POINTS].min(axis=0)
                unit = 1e-3 if name.endswith(".inp") else 1
                self.assertAlmostEqual(size.prod() * unit**3 / self.volume, 1, delta=1e-9)  # twelve digits in a deck

    @unittest.skipUnless(GMSH, "Gmsh is not installed")
    def test_gmsh_reads_the_tetrahedra(self):
        summary = json.loads((self.tetrahedra / "summary.json").read_text())
        said = gmsh(self.tetrahedra, 'Merge "mesh.msh";', "Plugin(MeshVolume).Run;")
        self.assertNotRegex(said, "Warning|Error")
        self.assertIn(f"{summary['nodes']} nodes", said)
        self.assertIn(f"{summary['elements']} elements", said)
        volume = float(re.search(r"Mesh volume .*: (\S+)", said).group(1))
        length, width, height = summary["cell_m"]
        self.assertAlmostEqual(volume / (length * width * height), 1, delta=1e-4)  # Gmsh prints six digits

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_meshio_reads_the_tetrahedra(self):
        summary = json.loads((self.tetrahedra / "summary.json").read_text())
        for name, extra in (("mesh.msh", 0), ("mesh.vtu", 0), ("abaqus.inp", 2), ("calculix.inp", 2)):
            read = meshio.read(self.tetrahedra / name)
            with self.subTest(name):
                self.assertEqual(len(read.points), summary["nodes"] + extra)
                self.assertEqual({block.type for block in read.cells}, {"tetra10"})
                self.assertEqual(sum(len(block.data) for block in read.cells), summary["elements"])

    @unittest.skipUnless(meshio, "meshio is not installed")
    def test_meshio_reads_the_surfaces(self):
        for ending in ("stl", "obj", "ply", "off"):
            for yarn in self.surfaces["by_yarn"]:
                with self.subTest(f"{name_of(yarn)}.{ending}"):
                    read = meshio.read(self.envelope / f"{name_of(yarn)}.{ending}")
                    triangles = read.cells_dict["triangle"]
                    self.assertEqual(len(triangles), yarn["triangles"])
                    volume = enclosed_volume(read.points.astype(float), triangles)
                    # Coordinates in STL are in single precision, 1e-7 of a cell ten times a yarn's height; the others hold them to the last bit.
                    self.assertAlmostEqual(volume / yarn["volume_m3"], 1, delta=1e-4 if ending == "stl" else 1e-9)
            with self.subTest(f"yarns.{ending}"):
                read = meshio.read(self.envelope / f"yarns.{ending}")
                self.assertEqual(len(read.cells_dict["triangle"]), self.surfaces["triangles"])

    def test_vtk_reads_the_surfaces(self):
        for yarn in self.surfaces["by_yarn"]:
            surface = read_by_vtk(vtkXMLPolyDataReader(), self.envelope / f"{name_of(yarn)}.vtp")
            self.assertEqual(surface.GetNumberOfPolys(), yarn["triangles"])
            self.assertEqual(surface.GetCellData().GetArray("yarn").GetRange(), (yarn["yarn"], yarn["yarn"]))
            measured = vtkMassProperties()
            measured.SetInputData(surface)
            self.assertAlmostEqual(measured.GetVolume() / yarn["volume_m3"], 1, delta=1e-6)
        together = read_by_vtk(vtkXMLPolyDataReader(), self.envelope / "yarns.vtp")
        self.assertEqual(together.GetNumberOfPolys(), self.surfaces["triangles"])

    def test_vtk_reads_the_fibers(self):
        for file in (self.relax / "relax.vtkhdf", self.envelope / "fibers.vtkhdf"):
            with self.subTest(file.name):
                grid = read_by_vtk(vtkHDFReader(), file)
                fibers = FIBERS * self.surfaces["yarns"]
                self.assertEqual(grid.GetNumberOfCells(), fibers)
                self.assertEqual({grid.GetCellType(i) for i in range(fibers)}, {VTK_POLY_LINE})
                yarns = grid.GetCellData().GetArray("yarn")
                self.assertEqual({yarns.GetTuple1(i) for i in range(fibers)}, {y["yarn"] for y in self.surfaces["by_yarn"]})
                self.assertGreater(grid.GetNumberOfPoints(), 2 * fibers)
                self.assertEqual(grid.GetPointData().GetArray("arc_m").GetNumberOfTuples(), grid.GetNumberOfPoints())

    @unittest.skipUnless(CCX, "CalculiX is not installed")
    def test_calculix_solves_the_deck(self):
        run = subprocess.run([CCX, "-i", "calculix"], cwd=self.mesh, capture_output=True, text=True, timeout=120)
        said = run.stdout + run.stderr
        self.assertEqual(run.returncode, 0, said)
        self.assertNotRegex(said, r"\*WARNING|\*ERROR")
        self.assertEqual(said.count("STEP "), 6)

    def test_textile_is_xml_with_the_yarns(self):
        root = xml.etree.ElementTree.parse(self.envelope / "yarns.tg3").getroot()
        self.assertEqual(root.tag, "TexGenModel")
        textile = root.find("Textile")
        self.assertEqual(textile.get("type"), "CTextile")
        self.assertEqual(len(textile.find("Domain").findall("Plane")), 6)
        yarns = textile.findall("Yarn")
        self.assertEqual(len(yarns), self.surfaces["yarns"])
        for yarn, summary in zip(yarns, self.surfaces["by_yarn"]):
            sections = yarn.find("YarnSection").findall("NodeSection/Section")
            self.assertEqual(len(sections), summary["rings"])
            self.assertEqual(len(yarn.findall("MasterNode")), summary["rings"])
            for section in sections:
                self.assertEqual(section.get("type"), "CSectionPolygon")
                self.assertEqual(len(section.findall("PolygonPoint")), summary["ring_points"])


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])

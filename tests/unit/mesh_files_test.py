"""Checks with VTK's own reader, and by Gmsh's description of its format, what heddle_mesh_files_writer wrote: mesh_files_test.py WRITER"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

from vtkmodules.vtkCommonDataModel import VTK_HEXAHEDRON, VTK_QUADRATIC_TETRA, VTK_TETRA
from vtkmodules.vtkFiltersVerdict import vtkMeshQuality
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

WRITER = sys.argv.pop(1)
COUNTS = (3, 2, 2)
ELEMENTS = 12
YARN = [i % 3 - 1 for i in range(ELEMENTS)]


def values(array):
    n = array.GetNumberOfComponents()
    return [array.GetTuple(i) if n > 1 else array.GetTuple1(i) for i in range(array.GetNumberOfTuples())]


def read(vtu):
    reader = vtkXMLUnstructuredGridReader()
    assert reader.CanReadFile(vtu)
    reader.SetFileName(vtu)
    reader.Update()
    return reader.GetOutput()


class MeshFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            vtu, msh = (str(pathlib.Path(folder) / name) for name in ("mesh.vtu", "mesh.msh"))
            subprocess.run([WRITER, "8", vtu, msh], check=True)
            cls.grid = read(vtu)
            cls.msh = pathlib.Path(msh).read_text().splitlines()

    def test_hexahedra(self):
        self.assertEqual(self.grid.GetNumberOfPoints(), 4 * 3 * 3)
        self.assertEqual(self.grid.GetNumberOfCells(), ELEMENTS)
        quality = vtkMeshQuality()
        quality.SetInputData(self.grid)
        quality.SetHexQualityMeasureToVolume()
        quality.Update()
        for i in range(ELEMENTS):
            self.assertEqual(self.grid.GetCellType(i), VTK_HEXAHEDRON)
            # Positive: corners are in VTK's order.
            self.assertAlmostEqual(quality.GetOutput().GetCellData().GetArray("Quality").GetTuple1(i), 0.5 * 0.5 * 0.25)
        bounds = self.grid.GetCell(1 + 3 * (1 + 2 * 0)).GetBounds()
        self.assertEqual(bounds, (1.0, 1.5, 0.5, 1.0, 0.0, 0.25))

    def test_cell_data(self):
        data = self.grid.GetCellData()
        inside = [y >= 0 for y in YARN]
        self.assertEqual(values(data.GetArray("YarnIndex")), YARN)
        self.assertEqual(values(data.GetArray("Yarn")), [(-1, 4, 9)[y + 1] for y in YARN])
        self.assertEqual(values(data.GetArray("Orientation")), [(i, 0.5, 0.25) if w else (0, 0, 0) for i, w in enumerate(inside)])
        self.assertEqual(values(data.GetArray("YarnTangent")), [(0, i, 1) if w else (0, 0, 0) for i, w in enumerate(inside)])
        self.assertEqual(values(data.GetArray("Location")), [(i, -i) if w else (0, 0) for i, w in enumerate(inside)])
        self.assertEqual(values(data.GetArray("VolumeFraction")), [0.01 * i if w else 0 for i, w in enumerate(inside)])
        self.assertEqual(values(data.GetArray("SurfaceDistance")), [-0.001 * i if w else 0 for i, w in enumerate(inside)])

    def test_tetrahedra(self):
        # Middle nodes by the edges that VTK and Gmsh (two of them the other way round) have them on.
        middles = [(0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0), (0, 0, 0.5), (0.5, 0, 0.5), (0, 0.5, 0.5)]
        for nodes, cell_type, gmsh_type in (("4", VTK_TETRA, "4"), ("10", VTK_QUADRATIC_TETRA, "11")):
            with self.subTest(nodes), tempfile.TemporaryDirectory() as folder:
                vtu, msh = (str(pathlib.Path(folder) / name) for name in ("mesh.vtu", "mesh.msh"))
                subprocess.run([WRITER, nodes, vtu, msh], check=True)
                grid = read(vtu)
                self.assertEqual(grid.GetNumberOfCells(), 1)
                self.assertEqual(grid.GetCellType(0), cell_type)
                cell = grid.GetCell(0)
                places = [grid.GetPoint(cell.GetPointId(i)) for i in range(cell.GetNumberOfPoints())]
                self.assertEqual(places, [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)] + (middles if nodes == "10" else []))
                lines = pathlib.Path(msh).read_text().splitlines()
                block, element = lines[lines.index("$Elements") + 2:lines.index("$EndElements")]
                self.assertEqual(block.split()[2], gmsh_type)
                order = [int(n) for n in element.split()[1:]]
                self.assertEqual(order, [1, 2, 3, 4] if nodes == "4" else [1, 2, 3, 4, 5, 6, 7, 8, 10, 9])

    def section(self, name):
        return self.msh[self.msh.index("$" + name) + 1:self.msh.index("$End" + name)]

    def test_gmsh(self):
        self.assertEqual(self.section("MeshFormat"), ["4.1 0 8"])
        self.assertEqual(self.section("PhysicalNames"), ["3", '3 1 "MATRIX"', '3 2 "YARN_4"', '3 3 "YARN_9"'])
        entities = self.section("Entities")
        self.assertEqual(entities[0], "0 0 0 3")
        for tag, line in enumerate(entities[1:], 1):
            words = line.split()
            self.assertEqual((int(words[0]), words[7:]), (tag, ["1", str(tag), "0"]))
        nodes = self.section("Nodes")
        self.assertEqual(nodes[0].split(), ["1", "36", "1", "36"])
        self.assertEqual(len(nodes), 2 + 2 * 36)
        x = [tuple(map(float, line.split())) for line in nodes[2 + 36:]]
        self.assertEqual(x, [self.grid.GetPoint(i) for i in range(36)])
        lines = iter(self.section("Elements"))
        blocks, count, least, largest = map(int, next(lines).split())
        self.assertEqual((blocks, count, least, largest), (3, ELEMENTS, 1, ELEMENTS))
        for _ in range(blocks):
            dimension, volume, kind, members = map(int, next(lines).split())
            self.assertEqual((dimension, kind), (3, 5))
            for _ in range(members):
                tag, *corners = map(int, next(lines).split())
                self.assertEqual(YARN[tag - 1] + 2, volume)
                ids = self.grid.GetCell(tag - 1).GetPointIds()
                self.assertEqual(corners, [ids.GetId(k) + 1 for k in range(8)])


if __name__ == "__main__":
    unittest.main()

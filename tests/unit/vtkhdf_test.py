"""Checks with VTK's own reader what heddle_vtkhdf_writer wrote: vtkhdf_test.py WRITER"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

from vtkmodules.vtkCommonDataModel import VTK_POLY_LINE
from vtkmodules.vtkIOHDF import vtkHDFReader

WRITER = sys.argv.pop(1)
NODES = [4, 2, 5]
FIBER_OF_NODE = [i for i, n in enumerate(NODES) for _ in range(n)]
PLACE_OF_NODE = [j for n in NODES for j in range(n)]


def values(array):
    return [array.GetTuple1(i) for i in range(array.GetNumberOfTuples())]


class VtkHdf(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            file = str(pathlib.Path(folder) / "weave.vtkhdf")
            subprocess.run([WRITER, file], check=True)
            reader = vtkHDFReader()
            assert reader.CanReadFile(file)
            reader.SetFileName(file)
            reader.Update()
            cls.grid = reader.GetOutput()

    def test_points(self):
        self.assertEqual(self.grid.GetNumberOfPoints(), sum(NODES))
        for n, (i, j) in enumerate(zip(FIBER_OF_NODE, PLACE_OF_NODE)):
            self.assertEqual(self.grid.GetPoint(n), (i, j, 0.1 * i * j))

    def test_cells_are_poly_lines(self):
        self.assertEqual(self.grid.GetNumberOfCells(), len(NODES))
        first = 0
        for i, n in enumerate(NODES):
            self.assertEqual(self.grid.GetCellType(i), VTK_POLY_LINE)
            ids = self.grid.GetCell(i).GetPointIds()
            self.assertEqual([ids.GetId(k) for k in range(ids.GetNumberOfIds())], list(range(first, first + n)))
            first += n

    def test_cell_data(self):
        data = self.grid.GetCellData()
        self.assertEqual(values(data.GetArray("yarn")), [10, 11, 12])
        self.assertEqual(values(data.GetArray("fiber")), [0, 1, 0])
        self.assertEqual(values(data.GetArray("weft")), [0, 0, 1])
        self.assertEqual(values(data.GetArray("radius")), [1e-4 * 1, 1e-4 * 2, 1e-4 * 3])

    def test_point_data(self):
        data = self.grid.GetPointData()
        tension = [0.5 * i + j for i, j in zip(FIBER_OF_NODE, PLACE_OF_NODE)]
        self.assertEqual(values(data.GetArray("tension_N")), tension)
        self.assertEqual(values(data.GetArray("stress_Pa")), [t / (1e-8 * (i + 1)) for t, i in zip(tension, FIBER_OF_NODE)])
        self.assertEqual(values(data.GetArray("radius_m")), [1e-4 * (i + 1) for i in FIBER_OF_NODE])
        self.assertEqual(values(data.GetArray("arc_m")), [1.5 * j for j in PLACE_OF_NODE])
        self.assertEqual(values(data.GetArray("yarn")), [10 + i for i in FIBER_OF_NODE])
        self.assertEqual(values(data.GetArray("fiber")), [i % 2 for i in FIBER_OF_NODE])

    def test_field_data(self):
        data = self.grid.GetFieldData()
        self.assertEqual(values(data.GetArray("time_s")), [0.125])
        self.assertEqual(values(data.GetArray("picks")), [2])


if __name__ == "__main__":
    unittest.main()

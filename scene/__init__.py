"""Appearance of a hand, its object and its contacts: drawing primitives, as arrays.

A scenario is converted to frames and entities, the samples of a trace to states; an adapter draws
the entities with the library of its medium. This package imports only the model and numpy.

    scenario --> frames_of, entities_of --+
                                          +--> adapter: Foxglove, viser, matplotlib
    trace ------> states_of --------------+

- **One geometry.** Everything has three dimensions. The model of a planar hand is the plane z = 0
  of the frame `plane`, which is vertical in the world; its object has a depth, and its marks are
  drawn in front of it. A planar hand has d = 2 coordinates and d - 1 tangents, a spatial one d = 3:
  `skeleton` defines the joints of a finger and the orientation of a contact frame, `states` how a
  pose is stored, `sizes` the depth of an object, `parts` its friction cone.
- **Frames** form a tree below `world`. A frame has a position and a rotation in its parent; each is
  constant, or a function of the states. Adapters for viewers that support frames pass them on;
  `world_poses` composes them for the others.
- **Entities** belong to a frame and hold primitives in its axes: triangles, lines, rods (tapered,
  so that a link is one), balls, arrows and cones. Coordinates are constant or functions of the
  states.
- **Roles** instead of colours: the palette belongs to the adapter. Primitives of a contact have
  the role of its phase.
- States hold many instants, one for each row of their arrays, so that a function is called once
  for a whole block of a recording, or with one row for a frame of the dashboard.
"""

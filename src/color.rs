//! Colour only at the edge of files: inside, everything is linear Rec.709.

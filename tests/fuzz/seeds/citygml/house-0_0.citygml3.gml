<?xml version="1.0" encoding="UTF-8"?>
<CityModel xmlns="http://www.opengis.net/citygml/3.0" xmlns:bldg="http://www.opengis.net/citygml/building/3.0" xmlns:con="http://www.opengis.net/citygml/construction/3.0" xmlns:dem="http://www.opengis.net/citygml/relief/3.0" xmlns:gen="http://www.opengis.net/citygml/generics/3.0" xmlns:gml="http://www.opengis.net/gml/3.2" xmlns:xlink="http://www.w3.org/1999/xlink" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://www.opengis.net/citygml/building/3.0 http://schemas.opengis.net/citygml/building/3.0/building.xsd http://www.opengis.net/citygml/relief/3.0 http://schemas.opengis.net/citygml/relief/3.0/relief.xsd http://www.opengis.net/citygml/generics/3.0 http://schemas.opengis.net/citygml/generics/3.0/generics.xsd" gml:id="city-model">
 <gml:name>mesh, tile 0_0</gml:name>
 <gml:boundedBy>
  <gml:Envelope srsName="urn:ogc:def:crs:EPSG::7415" srsDimension="3">
   <gml:lowerCorner>84999.5 445999.5 100.1908</gml:lowerCorner>
   <gml:upperCorner>85021.5 446021.5 101.7635</gml:upperCorner>
  </gml:Envelope>
 </gml:boundedBy>
 <cityObjectMember>
  <dem:ReliefFeature gml:id="terrain-0-0-relief">
   <dem:lod>1</dem:lod>
   <dem:reliefComponent>
    <dem:TINRelief gml:id="terrain-0-0">
     <dem:lod>1</dem:lod>
     <dem:tin>
      <gml:TriangulatedSurface gml:id="terrain-0-0_tin">
       <gml:patches>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">84999.5 445999.5 100.5198 85021.5 445999.5 100.1908 84999.5 446021.5 101.7635 84999.5 445999.5 100.5198</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
        <gml:Triangle>
         <gml:exterior>
          <gml:LinearRing>
           <gml:posList srsDimension="3">85021.5 445999.5 100.1908 85021.5 446021.5 101.3429 84999.5 446021.5 101.7635 85021.5 445999.5 100.1908</gml:posList>
          </gml:LinearRing>
         </gml:exterior>
        </gml:Triangle>
       </gml:patches>
      </gml:TriangulatedSurface>
     </dem:tin>
    </dem:TINRelief>
   </dem:reliefComponent>
  </dem:ReliefFeature>
 </cityObjectMember>
</CityModel>
